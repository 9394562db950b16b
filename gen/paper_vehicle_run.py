"""A run of our vehicle over the paper's track, to stand beside tables 5 to 8."""

from __future__ import annotations

import math
from functools import cache

from sosmith.gen.paper_vehicle import Simulated, SimulatedRun
from sosmith.gen.vehicle_comparison import NEAR, PAPER_SPEED, SMALLEST_RIPPLE
from sosmith.gen.vehicle_report import VehicleRun, vehicle_run
from sosmith.model.vehicle_parameters import built_in

SAMPLE_RATE = 100.0
"""Hz, of section 5.4."""


@cache
def run_of_ours() -> VehicleRun:
    """Run over the paper's track at its speed, with its single irregularity only."""
    return vehicle_run(
        built_in(), track="paper", speed=PAPER_SPEED, sample_rate=SAMPLE_RATE, irregularities="none", seed=1
    )


def simulated() -> SimulatedRun:
    """Figures of the run by the quantities of the paper's tables."""
    made = run_of_ours()
    limits = made.limits
    beyond, friction = 1000 * float(limits.beyond_flange.max()), float(limits.friction_used.max())
    remarks = (
        "Beside tables 5 to 8 stands a run of `sosmith vehicle` over the paper's track, at its speed and with its "
        "single irregularity, of a six-axle locomotive with parameters from other sources. It is linear, without "
        f"flanges: a wheelset goes up to {beyond:.1f} mm beyond its flange there, and creep takes up to {friction:.2f} "
        "times the friction there is. Beyond these limits its figures are not those of a real vehicle, and none is "
        "claimed to be the paper's.",
        "[vehicle.md](vehicle.md) has the model; its table of the same figures calls near what is within a factor of "
        f"{NEAR:g}, and has no label for what differs. Attenuations of {-20 * math.log10(SMALLEST_RIPPLE):.0f} dB "
        "stand for no motion at 50 Hz but rounding.",
    )
    rows = {
        row.what: Simulated(value=row.ours, same_quantity=row.same_quantity, why=row.why) for row in made.comparison
    }
    return SimulatedRun(rows=rows, remarks=remarks)
