"""The law that does nothing does nothing, to one vehicle and to many."""

import numpy as np
import pytest
from mjspace.controllers.missions.coast import Coast

from mjspace.contract import Measurement, Reference


@pytest.mark.parametrize("batch", [(), (4,)])
def test_no_torque(batch: tuple[int, ...]) -> None:
    shape = (*batch, 3)
    seen = Measurement(
        attitude=np.ones((*batch, 4)), rate=np.ones(shape), wheel_speed=np.ones(shape)
    )
    wanted = Reference(np.ones(4), np.ones(3), np.ones(3))
    law = Coast()
    state, command, signals = law.step(law.reset(seen, wanted), 1.0, seen, wanted)
    np.testing.assert_array_equal(command.torque, np.zeros(shape))
    assert state is None
    assert signals is None
