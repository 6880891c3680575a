"""The family of lander laws of paper 003 that the tests fly, named as their corrections are."""

from dataclasses import replace

import numpy as np
from mjspace.controllers.landing.lander import VariableStructure

PRINTED = VariableStructure(
    coordinates="polar",
    mixes_before_turning=False,
    follows_gravity=False,
    equilibrium_thrust=0.0,
    surface_gain=np.array([1.0, 14.0, 2.0]),
    thrust_range=np.array([0.0, np.inf]),
    gimbal_limit=np.pi,
)
LEAST_CORRECTED = replace(  # O1P: M1, M2, M3
    PRINTED,
    coordinates="scaled",
    equilibrium_thrust=160.0,
    surface_gain=np.array([1.0, 14.0, -2.0]),
)
MIXED = replace(LEAST_CORRECTED, mixes_before_turning=True)  # O1C: M5 too
FIGURE_6 = replace(MIXED, coordinates="frozen")  # O1: M6 too
LANDS = VariableStructure()  # O2
LANDS_BEHIND_LAGS = VariableStructure(loop_share=np.array([1.0, 0.35, 1.0]))  # O3
