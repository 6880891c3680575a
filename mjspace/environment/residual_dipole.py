"""The magnetic moment that a bus keeps when its coils are off, in the Earth's field."""

from typing import Annotated, Any, ClassVar

import numpy as np

from mjspace.contract import Array
from mjspace.environment import cubics
from mjspace.environment.base import Term
from mjspace.environment.magnetic_field import magnetic
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Si, Triple


class ResidualDipole(Term):
    """A constant magnetic moment of the bus: moment x field turns it (Wertz 1978, 17.2.4)."""

    kernels: ClassVar = {12: magnetic}
    reads: ClassVar = {"magnetic_field": 0}

    moment: Annotated[Triple, Si("A m^2")]
    """Body axes."""

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without a magnetic field."""
        if environment.magnetic_field is None:
            raise ValueError("residual_dipole: needs an [environment.magnetic_field]")

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the parameters of ``magnetic``."""
        return cubics.SIZE + 3

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the moment; the field's cubic is written as the vehicle flies."""
        return np.concatenate([np.zeros(cubics.SIZE), self.moment])
