"""Physical constants of the bodies that vehicles orbit: value, unit and source on one line."""

GM = {  # gravitational parameter [m^3/s^2]
    "earth": 3.986004418e14,  # IERS Conventions (2010), Technical Note 36, table 1.1 (TCG)
    "moon": 4.902800118e12,  # Park et al. 2021, JPL ephemerides DE440 and DE441, table 2
}

RADIUS = {  # [m]
    "earth": 6378136.6,  # equatorial; IERS Conventions (2010), Technical Note 36, table 1.1
    "moon": 1737400.0,  # mean; Archinal et al. 2018, IAU WGCCRE report 2015, table 5
}

J2 = {"earth": 1.0826359e-3}  # oblateness; IERS Conventions (2010), Technical Note 36, table 1.1

ASTRONOMICAL_UNIT = 149597870700.0  # m; IAU 2012, resolution B2
SUN_RADIUS = 6.957e8  # m; nominal, IAU 2015, resolution B3

STANDARD_GRAVITY = 9.80665  # m/s^2; CGPM 1901, resolution 2: for specific impulse
