"""Flies a rigid satellite in orbit in Basilisk: a script for an interpreter with bsk.

It does not import mjspace, which that interpreter need not have. It reads satellites as JSON from
standard input (SI units, as ``basilisk_orbit.describe`` returns them) and writes their motions as
JSON.
"""

import json
import math
import sys
from typing import Any

import numpy as np
from Basilisk import __version__
from Basilisk.architecture import messaging, sysModel
from Basilisk.simulation import (
    GravityGradientEffector,
    MtbEffector,
    exponentialAtmosphere,
    facetDragDynamicEffector,
    facetSRPDynamicEffector,
    magneticFieldCenteredDipole,
    spacecraft,
    svIntegrators,
)
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody


class Ephemeris(sysModel.SysModel):  # type: ignore[misc]
    """Where the Sun is, on a straight line, and how far the Earth has turned."""

    def __init__(self, sun: list[list[float]], duration: float, angle: float, rate: float):
        super().__init__()
        self.sun, self.earth = messaging.SpicePlanetStateMsg(), messaging.SpicePlanetStateMsg()
        self._sun, self._duration = np.array(sun), duration
        self._angle, self._rate = angle, rate

    def Reset(self, nanos: int) -> None:  # noqa: N802 - Basilisk's
        """Write what holds at the start."""
        self.UpdateState(nanos)

    def UpdateState(self, nanos: int) -> None:  # noqa: N802
        """Write what holds at a time [ns]."""
        time = nanos * macros.NANO2SEC
        first, last = self._sun
        place = first + time / self._duration * (last - first)
        sun = messaging.SpicePlanetStateMsgPayload(PositionVector=place.tolist())
        self.sun.write(sun, nanos, self.moduleID)
        cosine, sine = (f(self._angle + self._rate * time) for f in (math.cos, math.sin))
        turned = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]
        earth = messaging.SpicePlanetStateMsgPayload(J20002Pfix=turned)
        self.earth.write(earth, nanos, self.moduleID)


def fly(vehicle: dict[str, Any]) -> dict[str, Any]:
    """Return attitude as MRP, rate and position of the flight by RK4, in SI units.

    Everything is in one task. What is around the satellite is computed after each step from the
    state that was reached, and held during the next.
    """
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.SetProgressBar(False)
    process = simulation.CreateNewProcess("flight")
    process.addTask(simulation.CreateNewTask("flight", macros.sec2nano(vehicle["step"])))

    craft = spacecraft.Spacecraft()
    craft.ModelTag = "bus"
    integrator = svIntegrators.svIntegratorRK4(craft)
    craft.setIntegrator(integrator)
    craft.hub.mHub = vehicle["mass"]
    craft.hub.IHubPntBc_B = vehicle["inertia"]
    craft.hub.r_CN_NInit = vehicle["position"]
    craft.hub.v_CN_NInit = vehicle["velocity"]
    craft.hub.sigma_BNInit = _column(vehicle["mrp"])
    craft.hub.omega_BN_BInit = _column(vehicle["rate"])
    gravity = simIncludeGravBody.gravBodyFactory()
    earth = gravity.createEarth()
    earth.isCentralBody, earth.mu = True, vehicle["gm"]
    gravity.addBodiesTo(craft)
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName(earth.planetName)
    craft.addDynamicEffector(gradient)

    known = Ephemeris(
        vehicle["sun"], vehicle["duration"], vehicle["earth_angle"], vehicle["earth_rate"]
    )
    add = {"drag": _drag, "sunlight": _sunlight, "dipole": _dipole}
    kept = [make(craft, known, vehicle[name]) for name, make in add.items() if name in vehicle]
    for model in (craft, known, *(model for models, _ in kept for model in models)):
        simulation.AddModelToTask("flight", model)
    state = craft.scStateOutMsg.recorder(macros.sec2nano(vehicle["every"]))
    simulation.AddModelToTask("flight", state)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(vehicle["duration"]))
    simulation.ExecuteSimulation()
    return {
        "mrp": state.sigma_BN.tolist(),
        "rate": state.omega_BN_B.tolist(),
        "position": state.r_BN_N.tolist(),
    }


def _drag(craft: Any, known: Ephemeris, table: dict[str, Any]) -> tuple[list[Any], Any]:
    """Add drag in exponential air that does not turn; return its models, in order."""
    air = exponentialAtmosphere.ExponentialAtmosphere()
    air.planetRadius, air.scaleHeight = table["radius"], table["scale_height"]
    air.baseDensity = table["density"]
    air.addSpacecraftToModel(craft.scStateOutMsg)
    drag = facetDragDynamicEffector.FacetDragDynamicEffector()
    for facet in table["facets"]:
        drag.addFacet(facet["area"], facet["drag_coefficient"], facet["normal"], facet["position"])
    drag.atmoDensInMsg.subscribeTo(air.envOutMsgs[0])
    craft.addDynamicEffector(drag)
    return [air, drag], None


def _sunlight(craft: Any, known: Ephemeris, table: dict[str, Any]) -> tuple[list[Any], Any]:
    """Add the pressure of sunlight, without shadows."""
    light = facetSRPDynamicEffector.FacetSRPDynamicEffector()
    light.setNumFacets(len(table["facets"]))
    light.setNumArticulatedFacets(0)
    for facet in table["facets"]:
        axis = [0.0, 0.0, 0.0]  # about which the facet does not turn
        light.addFacet(
            facet["area"],
            np.eye(3),
            facet["normal"],
            axis,
            facet["position"],
            facet["diffuse"],
            facet["specular"],
        )
    light.sunInMsg.subscribeTo(known.sun)
    craft.addDynamicEffector(light)
    return [light], None


def _dipole(craft: Any, known: Ephemeris, table: dict[str, Any]) -> tuple[list[Any], Any]:
    """Add the torque of the Earth's dipole on a constant moment; return messages to keep too."""
    field = magneticFieldCenteredDipole.MagneticFieldCenteredDipole()
    field.planetRadius = 1.0  # m: the coefficients are the field times the radius cubed
    field.g11, field.h11, field.g10 = table["coefficients"]
    field.addSpacecraftToModel(craft.scStateOutMsg)
    field.planetPosInMsg.subscribeTo(known.earth)
    bar = MtbEffector.MtbEffector()
    shape = messaging.MTBArrayConfigMsgPayload(
        numMTB=3, GtMatrix_B=np.eye(3).ravel().tolist(), maxMtbDipoles=[1e3] * 3
    )
    shapes = messaging.MTBArrayConfigMsg().write(shape)
    moments = messaging.MTBCmdMsg().write(messaging.MTBCmdMsgPayload(mtbDipoleCmds=table["moment"]))
    bar.mtbParamsInMsg.subscribeTo(shapes)
    bar.mtbCmdInMsg.subscribeTo(moments)
    bar.magInMsg.subscribeTo(field.envOutMsgs[0])
    craft.addDynamicEffector(bar)
    return [field, bar], (shapes, moments)


def _column(vector: list[float]) -> list[list[float]]:
    return [[number] for number in vector]


if __name__ == "__main__":
    flights = [fly(vehicle) for vehicle in json.load(sys.stdin)["vehicles"]]
    print(json.dumps({"version": __version__, "flights": flights}))
