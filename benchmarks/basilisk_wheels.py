"""Flies a satellite with reaction wheels in Basilisk: a script for an interpreter with bsk.

It does not import mjspace, which that interpreter need not have. It reads vehicles as JSON, one a
line, from standard input (SI units, as ``against_basilisk.vehicle`` returns them). For each it
writes a line of JSON: how long the flight took, and how it ended.
"""

import json
import sys
import time
from typing import Any

import numpy as np
from Basilisk import __version__
from Basilisk.architecture import messaging
from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpFeedback, rwMotorTorque
from Basilisk.simulation import (
    GravityGradientEffector,
    reactionWheelStateEffector,
    simpleNav,
    spacecraft,
    svIntegrators,
)
from Basilisk.utilities import (
    SimulationBaseClass,
    macros,
    orbitalMotion,
    simIncludeGravBody,
    simIncludeRW,
)

EVERY = 1000  # steps between compared rows


def fly(vehicle: dict[str, Any]) -> dict[str, Any]:
    """Fly it by RK4 and return the wall time [s] of its execution, and its motion, in SI units.

    Everything is in one task at one rate, in the order in which a control period does it: the
    state that was reached is measured, the law commands, the wheels obey, the next step is made.
    """
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.SetProgressBar(False)
    process = simulation.CreateNewProcess("flight")
    process.addTask(simulation.CreateNewTask("flight", macros.sec2nano(vehicle["step"])))

    craft = spacecraft.Spacecraft()
    craft.ModelTag = "bus"
    craft.setIntegrator(svIntegrators.svIntegratorRK4(craft))
    craft.hub.mHub = vehicle["mass"]
    craft.hub.IHubPntBc_B = vehicle["inertia"]
    orbit = orbitalMotion.ClassicElements()
    for name, value in zip(("a", "e", "i", "Omega", "omega", "f"), vehicle["orbit"], strict=True):
        setattr(orbit, name, value)
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = orbitalMotion.elem2rv(vehicle["gm"], orbit)
    craft.hub.sigma_BNInit = _column(vehicle["mrp"])
    craft.hub.omega_BN_BInit = _column(vehicle["rate"])

    gravity = simIncludeGravBody.gravBodyFactory()
    earth = gravity.createEarth()
    earth.isCentralBody, earth.mu = True, vehicle["gm"]
    gravity.addBodiesTo(craft)
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName(earth.planetName)
    craft.addDynamicEffector(gradient)

    factory = simIncludeRW.rwFactory()
    for axis, speed in zip(vehicle["axes"], vehicle["wheel_speed"], strict=True):
        rpm = speed / macros.RPM
        factory.create(
            "custom", axis, Js=vehicle["wheel_inertia"], Omega=rpm, Omega_max=1e5, u_max=1e3
        )
    wheels = reactionWheelStateEffector.ReactionWheelStateEffector()
    factory.addToSpacecraft("wheels", wheels, craft)

    navigation, guidance = simpleNav.SimpleNav(), inertial3D.inertial3D()
    navigation.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    guidance.sigma_R0N = [0.0, 0.0, 0.0]
    error, law = attTrackingError.attTrackingError(), mrpFeedback.mrpFeedback()
    error.attNavInMsg.subscribeTo(navigation.attOutMsg)
    error.attRefInMsg.subscribeTo(guidance.attRefOutMsg)
    law.K, law.P, law.Ki = vehicle["stiffness"], vehicle["damping"], -1.0
    law.guidInMsg.subscribeTo(error.attGuidOutMsg)
    inertia = messaging.VehicleConfigMsgPayload(ISCPntB_B=np.ravel(vehicle["inertia"]).tolist())
    configuration = messaging.VehicleConfigMsg().write(inertia)
    law.vehConfigInMsg.subscribeTo(configuration)
    allocation, known = rwMotorTorque.rwMotorTorque(), factory.getConfigMessage()
    allocation.controlAxes_B = np.eye(3).ravel().tolist()
    allocation.vehControlInMsg.subscribeTo(law.cmdTorqueOutMsg)
    allocation.rwParamsInMsg.subscribeTo(known)
    wheels.rwMotorCmdInMsg.subscribeTo(allocation.rwMotorTorqueOutMsg)
    for model in (navigation, guidance, error, law, allocation, wheels, craft):
        simulation.AddModelToTask("flight", model)

    messages = {
        "state": craft.scStateOutMsg,
        "wheels": wheels.rwSpeedOutMsg,
        "error": error.attGuidOutMsg,
        "command": law.cmdTorqueOutMsg,
        "motors": allocation.rwMotorTorqueOutMsg,
    }
    recorders = {n: m.recorder() for n, m in messages.items() if vehicle["logged"] or n in RESULT}
    if not vehicle["logged"]:
        recorders = {
            name: messages[name].recorder(macros.sec2nano(EVERY * vehicle["step"]))
            for name in RESULT
        }
    for recorder in recorders.values():
        simulation.AddModelToTask("flight", recorder)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(vehicle["duration"]))
    start = time.perf_counter()
    simulation.ExecuteSimulation()
    seconds = time.perf_counter() - start
    every = EVERY if vehicle["logged"] else 1
    state, spun = recorders["state"], recorders["wheels"]
    return {
        "version": __version__,
        "seconds": seconds,
        "rows": len(state.times()),
        "mrp": np.asarray(state.sigma_BN)[::every].tolist(),
        "rate": np.asarray(state.omega_BN_B)[::every].tolist(),
        "wheel_speed": np.asarray(spun.wheelSpeeds)[::every, : len(vehicle["axes"])].tolist(),
    }


RESULT = ("state", "wheels")


def _column(vector: list[float]) -> list[list[float]]:
    return [[number] for number in vector]


if __name__ == "__main__":
    for line in sys.stdin:
        print(json.dumps(fly(json.loads(line))), flush=True)
