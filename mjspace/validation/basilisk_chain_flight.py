"""Flies a chain of hinged bodies on a free bus in Basilisk: a script for an interpreter with bsk.

It does not import mjspace, which that interpreter need not have. It reads the vehicle as JSON from
standard input (SI units, as ``basilisk_chain.describe`` returns it) and writes the motion as JSON.
"""

import json
import sys
from typing import Any

import numpy as np
from Basilisk import __version__
from Basilisk.simulation import spacecraft, spinningBodyNDOFStateEffector, svIntegrators
from Basilisk.utilities import SimulationBaseClass, macros


def fly(vehicle: dict[str, Any]) -> dict[str, Any]:
    """Return time, attitude as MRP, rate, hinge angles and rates of the flight by RK4, in SI."""
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.SetProgressBar(False)
    step = macros.sec2nano(vehicle["step"])
    process = simulation.CreateNewProcess("flight")
    process.addTask(simulation.CreateNewTask("dynamics", step))

    craft = spacecraft.Spacecraft()
    craft.ModelTag = "bus"
    integrator = svIntegrators.svIntegratorRK4(craft)
    craft.setIntegrator(integrator)
    bus = vehicle["bus"]
    craft.hub.mHub = bus["mass"]
    craft.hub.r_BcB_B = _column(bus["centre"])
    craft.hub.IHubPntBc_B = bus["inertia"]
    craft.hub.r_CN_NInit = _column([0.0, 0.0, 0.0])
    craft.hub.v_CN_NInit = _column([0.0, 0.0, 0.0])
    craft.hub.sigma_BNInit = _column([0.0, 0.0, 0.0])
    craft.hub.omega_BN_BInit = _column(vehicle["rate"])

    chain = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    for part in vehicle["chain"]:
        body = spinningBodyNDOFStateEffector.SpinningBody()
        body.setMass(part["mass"])
        body.setISPntSc_S(part["inertia"])
        body.setR_ScS_S(_column(part["centre"]))
        body.setR_SP_P(_column(part["position"]))
        body.setSHat_S(_column(part["axis"]))
        body.setDCM_S0P(np.eye(3).tolist())
        body.setThetaInit(part["angle"])
        body.setThetaDotInit(part["rate"])
        chain.addSpinningBody(body)
    craft.addStateEffector(chain)
    simulation.AddModelToTask("dynamics", craft)
    simulation.AddModelToTask("dynamics", chain)

    every = macros.sec2nano(vehicle["every"])
    state = craft.scStateOutMsg.recorder(every)
    hinges = [message.recorder(every) for message in chain.spinningBodyOutMsgs]
    for recorder in (state, *hinges):
        simulation.AddModelToTask("dynamics", recorder)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(vehicle["duration"]))
    simulation.ExecuteSimulation()
    return {
        "version": __version__,
        "time": (state.times() * macros.NANO2SEC).tolist(),
        "mrp": state.sigma_BN.tolist(),
        "rate": state.omega_BN_B.tolist(),
        "angles": np.transpose([hinge.theta for hinge in hinges]).tolist(),
        "rates": np.transpose([hinge.thetaDot for hinge in hinges]).tolist(),
    }


def _column(vector: list[float]) -> list[list[float]]:
    return [[number] for number in vector]


if __name__ == "__main__":
    json.dump(fly(json.load(sys.stdin)), sys.stdout)
