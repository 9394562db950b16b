"""A published creep force law."""

from __future__ import annotations

import numpy as np

from sosmith.instrument.vehicle.linear_motion import LinearSystem, Suspension
from sosmith.instrument.vehicle.wheel_rail_contact import Creep, contact_matrices


def cooperrider(speed: float, side_damping: float = 29.2e3, roll_damping: float = 20e3) -> LinearSystem:
    """Return the bogie of Cooperrider 1972 with seven coordinates, under a body that stands still.

    Figures as in DYTSI and, for the contact, as in papers of True and Kaas-Petersen, from memory.
    """
    b, d1, d2, h1, h2 = 1.074, 0.62, 0.68, 0.0762, 0.6584
    bogie = Suspension(("y1", "yaw1", "y2", "yaw2", "y", "yaw", "roll"))
    bogie.add({"y1": 1, "y": -1, "yaw": -b, "roll": -h1}, 1.823e6, count=2)
    bogie.add({"y2": 1, "y": -1, "yaw": b, "roll": -h1}, 1.823e6, count=2)
    bogie.add({"yaw1": d1, "yaw": -d1}, 3.646e6, count=2)
    bogie.add({"yaw2": d1, "yaw": -d1}, 3.646e6, count=2)
    bogie.add({"y": 1, "roll": -h2}, 0.1823e6, side_damping, count=2)
    bogie.add({"yaw": 1}, 2.71e6)
    bogie.add({"roll": d2}, 0.3333e6, roll_damping, count=2)
    bogie.add({"roll": d1}, 3.646e6, count=4)
    creep = Creep(f11=6.563e6 / 0.60252, f22=6.563e6 / 0.54219)
    damping, stiffness = contact_matrices(
        creep, speed=speed, conicity=0.05, rolling_radius=0.4572, half_spacing=0.716, load=0.0
    )
    for place in (slice(0, 2), slice(2, 4)):
        bogie.damping[place, place] += damping
        bogie.stiffness[place, place] += stiffness
    mass = np.diag([1022, 678, 1022, 678, 2918.9, 6780, 6780.0])
    return LinearSystem(names=bogie.names, mass=mass, damping=bogie.damping, stiffness=bogie.stiffness)
