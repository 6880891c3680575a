"""Attitude kinematics of the benchmarks' independent integrations."""


def quaternion_slope(
    q0: float, q1: float, q2: float, q3: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return q' = q (0, w) / 2 for the rate w = (x, y, z) [rad/s] in body axes.

    Plain numbers are ten times as fast as arrays of this size.
    """
    return (
        0.5 * (-q1 * x - q2 * y - q3 * z),
        0.5 * (q0 * x + q2 * z - q3 * y),
        0.5 * (q0 * y + q3 * x - q1 * z),
        0.5 * (q0 * z + q1 * y - q2 * x),
    )
