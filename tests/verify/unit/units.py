"""Small folded and serial cores, what is said of their texts, and what a simulation sees of them."""

from __future__ import annotations

import random
from functools import cache

from tests.verify.parallel.simulated import Simulation
from tests.verify.program.programs import Made, small
from tests.verify.small_specifications import STEADY_INSTRUMENT

from sosmith.verify.certificate_file import AboutEntry, Certificate, ItemEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.netlist import flattened
from sosmith.verify.program.check import check_program
from sosmith.verify.reader.source import read_source
from sosmith.verify.unit.check import UnitVerdict, check_unit

WORN = """
[wear]
initial = 3.0
warning = 2.0
limit = 4.0
"""

SEVERAL = "channels = 3\n" + STEADY_INSTRUMENT + WORN.replace("3.0", "[3.0, 3.5, 4.0]")


def stated(core: Made) -> Certificate:
    """Return the certificate of a core with what it says of the flags."""
    item = ItemEntry.model_construct(wear=core.design.datapath.wear, calibrated=core.design.datapath.calibrated)
    about = AboutEntry.model_construct(item=item)
    return core.certificate.model_copy(update={"about": about})


class Unit:
    """A core with what its certificate says of it."""

    def __init__(self, spec: str, architecture: str, channels: int, realization: str, products: int) -> None:
        self.core = small(spec, architecture, realization, channels, products)
        self.certificate = stated(self.core)
        self.text, self.channels, self._serial = self.core.text, channels, architecture == "serial"

    def check(self, text: str | None = None) -> UnitVerdict:
        return check_unit(text or self.text, self.certificate, serial=self._serial)

    def rejection(self, text: str) -> str:
        """Return the sentence of a rejection, of the unit or of the program; nothing if a text is accepted."""
        everything = tuple((port.lowest, port.highest) for port in self.certificate.inputs)
        try:
            self.check(text)
            check_program(text, self.certificate, calibrated=self.core.design.datapath.calibrated or everything)
        except RejectedError as error:
            return str(error)
        return ""

    def seen(self, text: str, clocks: int, seed: int) -> list[dict[str, int]]:
        """Return the outputs at each clock, as far as they mean something, for a source that holds what it offers."""
        netlist = flattened(read_source(text, self.certificate.name).modules, "aclk")
        simulation, rng = Simulation(netlist), random.Random(seed)
        width = netlist.widths["s_axis_tdata"]
        row = {"aclk": 0, "s_axis_tvalid": 0}
        found = []
        busy, ready = 1.0, 1.0
        for clock in range(clocks):
            if clock % 64 == 0:
                busy, ready = rng.choice((0.05, 0.5, 1.0)), rng.choice((0.02, 0.5, 1.0))
            row |= {"aresetn": int(clock > 1 and rng.random() > 0.001), "m_axis_tready": int(rng.random() < ready)}
            if not row["s_axis_tvalid"]:
                extremes = (0, (1 << width) - 1, (1 << (width - 1)) - 1, 1 << (width - 1))
                data = rng.choice((*extremes, *(rng.getrandbits(width) for _ in range(4))))
                row |= {"s_axis_tvalid": int(rng.random() < busy), "s_axis_tdata": data}
                if self.channels > 1:
                    row["s_axis_tdest"] = rng.randrange(self.channels + 1)
            out = simulation.outputs(row)
            simulation.clock()
            found.append(out if out["m_axis_tvalid"] else {k: out[k] for k in ("m_axis_tvalid", "s_axis_tready")})
            if (out["s_axis_tready"] and row["s_axis_tvalid"]) or not row["aresetn"]:
                row["s_axis_tvalid"] = 0
        return found


@cache
def unit(
    spec: str, architecture: str = "folded", channels: int = 1, realization: str = "df1_ef1", products: int = 1
) -> Unit:
    return Unit(spec, architecture, channels, realization, products)
