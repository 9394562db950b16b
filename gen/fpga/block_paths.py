"""Paths through the multiplier blocks of an iCE40 UP5K, which nextpnr ends at the blocks.

::

    what nextpnr times      FF --logic--> | SB_MAC16 |      | SB_MAC16 | --logic--> FF
    what the signal takes   FF --logic--> A --product--> adder --> O --logic--> FF
                            FF --logic--> C, D -----------^

nextpnr-ice40 takes every pin of a block for that of a register, whether the block has one there or not, so that its
fmax leaves out what passes through, and a block without a clock even counts as a clock domain of its own. Here these
paths are timed from the delays that nextpnr writes of the placed design (`--sdf`), with those of the blocks from the
timing of the UP5K that Project IceStorm has from the vendor's tools
(https://github.com/YosysHQ/icestorm/blob/master/icefuzz/timings_up5k.txt, cell SB_MAC16): of each kind of path through
a block the longest. So what a clock achieves is a lower bound, as far as nextpnr's own delays hold. All registers are
taken to have the same edge of their clock, and clocks to reach all of them at the same time; a path that ends in a
register whose clock has another name in the report counts for each clock there.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Any, NamedTuple

from sosmith.model.errors import ToolError

_LONGEST = {"A": (7.4, 8.9), "B": (7.4, 8.9), "D": (3.4, 4.0), "C": (0.0, 3.0), "": (4.0, 4.0)}
"""From a factor or an addend to the lower and to the upper half of the output, in ns; "" is what controls the adder.

Of the delays there, from B[1] to O[14] 7.308 and to O[31] 8.813, from D[1] to O[14] 3.226, from D[5] to O[31] 3.862,
and from C[1] to O[31] 2.947. The upper addend does not reach the lower half.
"""

_FROM_OUTPUT = 1.6
"""From the clock to a registered output in ns: 1.582 to O[31]."""

_SETUP_TIME = 0.1
"""That of a registered input in ns, as nextpnr has it."""

_UNCLOCKED = "$PACKER_GND_NET"
"""What blocks without a clock have for one."""

_CLOCKS = frozenset({"CLK", "RCLK", "WCLK", "CLOCK", "INPUT_CLK", "OUTPUT_CLK"})
_FACTORS = "AB"
_DATA = re.compile(r"([ABCDO])_(\d+)")
_CONTROL = re.compile(r"ADDSUB(TOP|BOT)|OLOAD(TOP|BOT)|CI|ACCUMCI|SIGNEXTIN")
_HALVES = ("TOP_8x8_MULT_REG", "BOT_8x8_MULT_REG", "PIPELINE_16x16_MULT_REG1")
_WHOLE = "PIPELINE_16x16_MULT_REG2"
"""Registers of the product: of its parts, which cut all ways through it if all are there, and of all of it."""

_HALF = 16
_REGISTERED = "01"
"""What selects the register behind the adder as the upper or lower half of the output."""

_CELL = re.compile(r'\(CELLTYPE "(\w+)"\)\s*\(INSTANCE (\S*)\)')
_DELAYS = r"\((\d+):\d+:(\d+)\)"
_WIRE = re.compile(rf"\(INTERCONNECT (\S+) (\S+) {_DELAYS} {_DELAYS}\)")
_STEP = re.compile(rf"\(IOPATH (\S+) (\S+) {_DELAYS} {_DELAYS}\)")
_SETUP = re.compile(rf"\(SETUPHOLD \(\w+ (\S+)\) \(\w+ \S+\) {_DELAYS}")

Pin = tuple[str, str]
"""A cell and its port."""


class _Step(NamedTuple):
    """A way to a pin: from where, how many ns, and whether it is in a block where nextpnr sees a register."""

    source: Pin
    delay: float
    unseen: bool = False


def with_block_paths(report: dict[str, Any], sdf: str, netlist: dict[str, Any]) -> dict[str, Any]:
    """Return the report of nextpnr-ice40 with what its clocks achieve when paths through blocks count.

    Parameters
    ----------
    report : dict
        What nextpnr writes with `--report`.
    sdf : str
        What it writes with `--sdf`.
    netlist : dict
        The design that it has placed, as Yosys writes it.
    """
    (top,) = (module for module in netlist["modules"].values() if "top" in module["attributes"])
    blocks = {f"{name}_DSP": cell["parameters"] for name, cell in top["cells"].items() if cell["type"] == "SB_MAC16"}
    if not blocks:
        return report
    try:
        slowest = _Timing(sdf, blocks).slowest()
    except CycleError:
        raise ToolError("paths through multiplier blocks must have an end, not lead back to where they begin") from None
    clocks = {name: dict(timing) for name, timing in report["fmax"].items() if _UNCLOCKED not in name}
    paths = {
        (path["from"], path["to"]): path
        for path in report["critical_paths"]
        if _UNCLOCKED not in path["from"] + path["to"]
    }
    elsewhere = [path for clock, path in slowest.items() if clock not in clocks]
    for name, timing in clocks.items():
        path = max((*elsewhere, slowest.get(name, [])), key=_length)
        if path and (achieved := 1e3 / _length(path)) < timing["achieved"]:
            timing["achieved"] = achieved
            edge = f"posedge {name}"
            paths[edge, edge] = {"from": edge, "to": edge, "path": path}
    return report | {"fmax": clocks, "critical_paths": list(paths.values())}


def _length(path: Sequence[Mapping[str, Any]]) -> float:
    return float(sum(step["delay"] for step in path))


class _Timing:
    """The placed design as a graph of pins, and where its registers are."""

    def __init__(self, sdf: str, blocks: dict[str, dict[str, str]]) -> None:
        self._steps: defaultdict[Pin, list[_Step]] = defaultdict(list)
        self._ends: defaultdict[Pin, list[_Step]] = defaultdict(list)
        self._clocks: dict[str, str] = {}
        for driver, sink, *delays in _WIRE.findall(sdf):
            source, target = _pin(driver), _pin(sink)
            if target[1] in _CLOCKS:  # clocks reach all registers at the same time
                self._clocks[target[0]] = source[0].removeprefix("$gbuf_")
            else:
                self._steps[target].append(_Step(source, _ns(delays)))
        for kind, cell, body in _cells(sdf):
            if kind == "ICESTORM_DSP":
                self._block(cell, blocks[cell], body)
                continue
            for start, end, *delays in _STEP.findall(body):
                self._steps[cell, end].append(_Step((cell, start), _ns(delays)))
            for port, *delays in _SETUP.findall(body):
                self._ends[cell, port].append(_Step((cell, port), _ns(delays)))

    def _block(self, cell: str, parameters: dict[str, str], body: str) -> None:
        """Add the ways through a block, those to its registers, and those from them."""
        clock = (cell, "CLK")
        cut = parameters[_WHOLE] == "1" or all(parameters[register] == "1" for register in _HALVES)
        product = cut or any(parameters[register] == "1" for register in _HALVES)
        inputs: list[tuple[Pin, str, int]] = []
        for pin in [pin for pin in self._steps if pin[0] == cell]:
            found = _DATA.fullmatch(pin[1])
            if found or _CONTROL.fullmatch(pin[1]):
                side, place = (found[1], int(found[2])) if found else ("", 0)
                inputs.append((pin, side, place))
            if not found or parameters[f"{found[1]}_REG"] == "1":
                self._ends[pin].append(_Step(pin, _SETUP_TIME))
        starts = {pin: clock if side and parameters[f"{side}_REG"] == "1" else pin for pin, side, _ in inputs}
        for pin, side, _ in inputs:
            if side and side in _FACTORS and product:
                self._ends[pin].append(_Step(starts[pin], max(_LONGEST[side]), unseen=True))
        for end in {end for _, end, *_ in _STEP.findall(body) if _DATA.fullmatch(end)}:
            bit = int(end[2:])
            inside = [_Step(clock, max(_LONGEST["A"]), unseen=True)] if product else []
            inside += [
                _Step(starts[pin], _LONGEST[side][bit >= _HALF], unseen=True)
                for pin, side, place in inputs
                if _reaches(side, place, bit) and not (cut and side and side in _FACTORS)
            ]
            if parameters["TOPOUTPUT_SELECT" if bit >= _HALF else "BOTOUTPUT_SELECT"] == _REGISTERED:
                self._ends[cell, end] += inside
                self._steps[cell, end].append(_Step(clock, _FROM_OUTPUT, unseen=True))
            else:
                self._steps[cell, end] += inside

    def slowest(self) -> dict[str, list[dict[str, Any]]]:
        """Return the slowest path with a way that nextpnr does not see, step by step, by the clock of its end."""
        # Only what comes from a register: pins of the FPGA and constants have no clock.
        every = [step.source for steps in (*self._steps.values(), *self._ends.values()) for step in steps]
        seen = {pin: _Arrival(0.0) for pin in every if pin[1] in _CLOCKS}
        unseen: dict[Pin, _Arrival] = {}
        before = {pin: {step.source for step in of} for pin, of in self._steps.items()}
        for pin in TopologicalSorter(before).static_order():
            steps = self._steps.get(pin, ())
            arrivals = [seen[step.source].after(step) for step in steps if step.source in seen]
            if arrivals:
                seen[pin] = max(arrivals)
            if (last := _last(steps, seen, unseen)) is not None:
                unseen[pin] = last
        slowest: dict[str, tuple[Pin, _Arrival]] = {}
        for pin, steps in self._ends.items():
            clock, last = self._clocks.get(pin[0], ""), _last(steps, seen, unseen)
            if last is not None and (clock not in slowest or slowest[clock][1] < last):
                slowest[clock] = pin, last
        return {clock: list(_told(*end, seen, unseen))[::-1] for clock, end in slowest.items()}


class _Arrival(NamedTuple):
    """When the last signal arrives at a pin, in ns after the clock, and the last step of its way."""

    time: float
    step: _Step | None = None

    def after(self, step: _Step) -> _Arrival:
        """When it arrives one step further on."""
        return _Arrival(self.time + step.delay, step)


def _last(steps: Iterable[_Step], seen: Mapping[Pin, _Arrival], unseen: Mapping[Pin, _Arrival]) -> _Arrival | None:
    """Return when the last signal arrives that has passed a way that nextpnr does not see; None if none does."""
    arrivals = [
        ways[step.source].after(step)
        for step in steps
        for ways in (seen if step.unseen else unseen,)
        if step.source in ways
    ]
    return max(arrivals, default=None)


def _told(
    pin: Pin, arrival: _Arrival, seen: Mapping[Pin, _Arrival], unseen: Mapping[Pin, _Arrival]
) -> Iterator[dict[str, Any]]:
    """Yield the steps of a path as nextpnr tells them, from the last to the first."""
    kind, ways = "setup", unseen
    while arrival.step is not None:
        step = arrival.step
        if kind != "setup":
            kind = "routing" if step.source[0] != pin[0] else "logic"
        yield {
            "type": "clk-to-q" if step.source[1] in _CLOCKS and not step.unseen else kind,
            "delay": step.delay,
            "from": {"cell": step.source[0], "port": step.source[1]},
            "to": {"cell": pin[0], "port": pin[1]},
        }
        ways = seen if step.unseen else ways
        pin, kind = step.source, ""
        arrival = ways[pin]


def _reaches(side: str, place: int, bit: int) -> bool:
    """Whether a bit of a factor or addend can change one of the output; two bits of a factor are recoded as one."""
    if not side:
        return True
    if side in _FACTORS:
        return bit >= place - 1
    return bit >= place + (_HALF if side == "C" else 0)


def _cells(sdf: str) -> Iterator[tuple[str, str, str]]:
    """Yield the cells: their types, names, and what is said of each."""
    found = list(_CELL.finditer(sdf))
    for one, end in zip(found, [*(other.start() for other in found[1:]), len(sdf)], strict=True):
        yield one[1], _name(one[2]), sdf[one.end() : end]


def _pin(text: str) -> Pin:
    cell, _, port = text.rpartition("/")
    return _name(cell), _name(port)


def _name(text: str) -> str:
    return text.replace("\\", "")


def _ns(delays: Sequence[str]) -> float:
    return max(map(int, delays)) / 1e3
