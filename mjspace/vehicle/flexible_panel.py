"""A flexible panel: a chain of rigid segments with springs and dampers at its hinges.

The bending stiffness of a uniform cantilever of length L in N segments of length l = L/N is lumped
at the segments' inboard ends. The spring between two segments stands for the bending of half of
each, EI/l. That at the root stands for half a segment alone, 2 EI/l: with EI/l there as well the
frequencies would approach the beam's as 1/N only, with twice that they do as 1/N^2.

EI follows from the frequency of the first cantilevered mode: the eigenvalues of K x = w^2 M x, with
MuJoCo's mass matrix M of the chain itself, are proportional to it. Dampers are proportional to the
springs, C = 2 z/w K: the first mode has the damping ratio z, mode i has z w_i/w. Each joint's
spring and damper are evaluated in every stage of the integrator.
"""

import math
from typing import Annotated, Any

import mujoco
import numpy as np
from pydantic import Field

from mjspace.contract import Array
from mjspace.scenario.fields import Positive, Si
from mjspace.scenario.mounted import MovingPart, Report
from mjspace.vehicle.composition import ASSETS
from mjspace.vehicle.moving_parts import measure_joint, measure_place, new_part, set_inertia
from mjspace.vehicle.stability import mass_matrix

_THICKNESS = 0.02  # m, drawn; its inertia is that of a thin plate
_GAP = 0.04  # between what is drawn of two segments, as a share of a segment
_CELL = 0.12  # m
_CELLS = ASSETS / "parts/bus/cells.png"


class Panel(MovingPart):
    """A uniform flexible panel along its x axis that bends about its y axis, its cells facing z."""

    length: Annotated[Positive, Si("m")]
    """From the bus to the tip, along x."""
    width: Annotated[Positive, Si("m")]
    """Along y."""
    mass: Annotated[Positive, Si("kg")]
    frequency: Annotated[Positive, Si("Hz")]
    """Of the first bending mode with the bus held fixed, undamped."""
    damping_ratio: Annotated[float, Field(ge=0, lt=1, strict=True)] = 0.0
    """Of that mode; of others in proportion to their frequencies."""
    segments: Annotated[int, Field(ge=1, le=20, strict=True)] = 4
    """How many rigid plates it is made of, each on a hinge: one is a plate on a spring."""

    def build(self) -> Any:
        """Return the chain: segments ``segment_0``, ... on hinges ``hinge_0``, ..., root first."""
        part = self._chain()
        relative = np.full(self.segments, 1.0)
        relative[0] = 2.0
        stiffness, damping = self._calibrated(mass_matrix(part.copy().compile()), relative)
        for joint, share in zip(part.joints, relative, strict=True):
            joint.stiffness[0], joint.damping[0] = stiffness * share, damping * share
        return part

    def reports(self) -> tuple[Report, ...]:
        """Return the tip's deflection along z and the hinges' angles."""
        return (
            Report("deflection", "m", "tip", slice(2, 3)),
            Report("hinge_angle", "rad", "hinge_0", slice(0, self.segments)),
        )

    def _calibrated(self, inertia: Array, relative: Array) -> tuple[float, float]:
        """Return stiffness [N m/rad] and damping [N m s/rad] of a hinge with the share 1."""
        from scipy.linalg import eigh

        rate = 2.0 * math.pi * self.frequency
        lowest = eigh(np.diag(relative), inertia, eigvals_only=True)[0]
        stiffness = rate**2 / lowest
        return stiffness, 2.0 * self.damping_ratio / rate * stiffness

    def _chain(self) -> Any:
        part = new_part()
        part.add_texture(
            name="cells",
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            file=str(_CELLS),
        )
        length, mass = self.length / self.segments, self.mass / self.segments
        cells = part.add_material(name="cells", specular=0.5, shininess=0.6)
        cells.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "cells"
        cells.texrepeat = [max(1.0, round(side / _CELL / 2)) for side in (length, self.width)]
        about_x, about_y = mass / 12.0 * self.width**2, mass / 12.0 * length**2
        moments = np.array([about_x, about_y, about_x + about_y])
        body, middle = part.worldbody, np.array([0.5 * length, 0.0, 0.0])
        for number in range(self.segments):
            at = [length if number else 0.0, 0.0, 0.0]
            body = body.add_body(name=f"segment_{number}", pos=at)
            set_inertia(body, mass, middle, moments)
            body.add_joint(name=f"hinge_{number}", axis=[0.0, 1.0, 0.0])
            measure_joint(part, f"hinge_{number}")
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[0.5 * (1.0 - _GAP) * length, 0.5 * self.width, 0.5 * _THICKNESS],
                pos=middle,
                material="cells",
            )
        measure_place(part, "tip", body, np.array([length, 0.0, 0.0]))
        return part
