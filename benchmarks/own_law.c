/* Feedback of the attitude in modified Rodrigues parameters, as own_law.py has it. */
#include "own_law.h"

const char mjspace_law_layout[] = MJSPACE_LAW_LAYOUT;

int feedback(const mjspace_input *in, mjspace_state *state, mjspace_output *out) {
  const double *a = in->reference.attitude, *b = in->measurement.attitude;
  const double e[4] = {
      a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3],
      a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
      a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1],
      a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0],
  };
  const double sign = e[0] < 0.0 ? -1.0 : 1.0;
  (void)state;
  for (int i = 0; i < 3; i++) {
    out->signals.sigma[i] = sign * e[i + 1] / (1.0 + sign * e[0]);
    out->command.torque[i] = -in->gains.stiffness * out->signals.sigma[i] -
                             in->gains.damping * in->measurement.rate[i];
  }
  return 0;
}
