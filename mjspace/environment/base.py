"""What every term of the native environment is: a table, a block of ``userdata`` and a kernel.

A vehicle's ``userdata`` holds the parameters, as state, so that vehicles of one batch may differ:

    MAGIC, number of dofs, first dof of the bus, address of the sensor (-1: none)
    kind, length, payload...                one block for each term, to the end or to a kind 0
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from mjspace.contract import Array
from mjspace.environment.compiled import compiled
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Table

MAGIC = 6.02214076e23
"""What the ``userdata`` of a vehicle begins with."""
HEADER = 4
"""How many numbers precede the first block."""


class Term(Table, ABC):
    """A force or torque that acts at every stage of the integrator; its fields are its table."""

    kernels: ClassVar[Mapping[int, compiled]]
    """By the number of its kind of block, which stands in logs and is never used again for another:
    a compiled function of (payload, time [s], ``bodies.Bodies``) that adds to ``qfrc_passive``."""

    reads: ClassVar[Mapping[str, int]] = {}
    """What is written into its parameters in flight, of what ``Assembly.known`` has, by name, and
    where it begins in them."""

    def block_kind(self) -> int:
        """Return which of the ``kernels`` acts; to be overridden where there are several."""
        (kind,) = self.kernels
        return kind

    def check_environment(self, environment: Environment) -> None:
        """Check what the term needs of the rest of the ``environment``; nothing by default.

        Raises:
            ValueError: it cannot act in it; with the key and what would be right.
        """

    @abstractmethod
    def payload_size(self, environment: Environment) -> int:
        """Return how many numbers ``pack`` returns; the model is not compiled yet.

        ``environment`` is all that acts.
        """

    @abstractmethod
    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the kernel's parameters, shape (payload_size,).

        ``model`` is the compiled ``mujoco.MjModel``.

        Raises:
            ValueError: the model lacks what the term acts on.
        """
