"""Pictures of docs/hardware.md, docs/registers.md and docs/boards.md: blocks, handshakes, a load, wiring.

python -m benchmarks.hardware_pictures            write docs/images/
python -m benchmarks.hardware_pictures --check    say what is out of date, status 1 if anything is

The handshakes are those of a generated core in Amaranth's simulator, clock by clock. The blocks are the stages of a
design with their words. The wiring is that of the table of boards.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import wavedrom
from amaranth.hdl import ClockDomain, ClockSignal, Module
from amaranth.sim import Simulator
from matplotlib.patches import Rectangle

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.picture import BLUE, GREEN, GREY, RED, picture
from sosmith.gen.specification.specification import from_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
IMAGES = "docs/images"

_SMALL = """\
name = "pipelined"
sample_rate = 1000.0
[input.x]
bits = 12
signed = true
range = [-1.0, 1.0]
[filter]
family = "butterworth"
kind = "lowpass"
order = 1
cutoff = 100.0
[output]
bits = 12
signed = true
range = [-1.0, 1.0]
max_error = "faithful"
[hardware]
realization = "df1"
architecture = "parallel"
"""

_OFFERS = (0, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0)
"""Clocks in which the source of the picture has a sample."""


def streams() -> str:
    """Draw both streams of a pipeline that has to wait for its sink."""
    design = design_core(from_text(_SMALL, Path("pipelined.toml")))
    dut: Any = design.architecture.component()
    latency = design.architecture.latency_cycles
    names = ("s_axis_tvalid", "s_axis_tready", "m_axis_tvalid", "m_axis_tready")
    seen: dict[str, list[int]] = {name: [] for name in names}
    data: dict[str, list[str]] = {"s_axis_tdata": [], "m_axis_tdata": []}

    async def bench(ctx: Any) -> None:
        ctx.set(dut.aresetn, 0)
        await ctx.tick("bench").repeat(2)
        ctx.set(dut.aresetn, 1)
        while not ctx.get(dut.s_axis_tready):
            await ctx.tick("bench")
        taken = given = 0
        held = 0  # clocks for which the sink keeps the third result waiting
        offers = False
        for clock in range(len(_OFFERS) + latency):
            wanted = clock < len(_OFFERS) and bool(_OFFERS[clock])
            offers = offers or wanted  # what is offered stays until it is taken
            ctx.set(dut.s_axis_tvalid, offers)
            waits = given == 2 and bool(ctx.get(dut.m_axis_tvalid)) and held < 3
            held += waits
            ctx.set(dut.m_axis_tready, not waits)
            for name in names:
                seen[name].append(ctx.get(getattr(dut, name)))
            data["s_axis_tdata"].append(f"x{taken}" if offers else "")
            data["m_axis_tdata"].append(f"y{given}" if seen["m_axis_tvalid"][-1] else "")
            moved = offers and seen["s_axis_tready"][-1]
            given += seen["m_axis_tvalid"][-1] and seen["m_axis_tready"][-1]
            await ctx.tick("bench")
            if moved:
                taken, offers = taken + 1, False

    _run(dut, bench)
    lines = [{"name": "aclk", "wave": "p" + "." * (len(seen[names[0]]) - 1)}]
    for stream in ("s_axis", "m_axis"):
        lines += [{"name": f"{stream}_{end}", "wave": _wave(seen[f"{stream}_{end}"])} for end in ("tvalid", "tready")]
        lines.append(_values(f"{stream}_tdata", data[f"{stream}_tdata"]))
    return _rendered(
        lines, "a sample moves where tvalid and tready are both high; a sink that waits holds the pipeline", 1
    )


def reload() -> str:
    """Draw a load: what the host writes, and when the new set becomes active."""
    samples = ["sample 0"] * 3 + ["sample 1"] * 2 + ["sample 2"] * 3 + ["sample 3"] * 3
    steps: list[tuple[str, list[Any]]] = [
        ("host writes", ["", "VERSION", "DATA", "DATA", "...", "DATA", "CRC", "", "", "", ""]),
        ("fills", ["", "", "word 0", "word 1", "...", "word n", "", "", "", "", ""]),
        ("LOADING", [0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 0]),
        ("PENDING", [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]),
        ("in the core", samples),
        ("uses the set", ["old"] * 8 + ["new"] * 3),
    ]
    lines = [
        _values(name, [str(one) for one in values]) if name[0].islower() else {"name": name, "wave": _wave(values)}
        for name, values in steps
    ]
    return _rendered(lines, "a set becomes active between two samples, whole, or not at all; not to scale", 2)


def _run(dut: Any, bench: Any) -> None:
    m = Module()
    m.domains.bench = ClockDomain(reset_less=True)
    m.submodules.core = dut
    m.d.comb += dut.aclk.eq(ClockSignal("bench"))
    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="bench")
    simulator.add_testbench(bench)
    simulator.run()


def _wave(bits: Sequence[Any]) -> str:
    return "".join("." if k and bit == bits[k - 1] else str(int(bit)) for k, bit in enumerate(bits))


def _values(name: str, texts: Sequence[str]) -> dict[str, Any]:
    wave, labels = "", []
    for k, text in enumerate(texts):
        if k and text == texts[k - 1]:
            wave += "."
        elif text:
            wave += "34"[len(labels) % 2]
            labels.append(text)
        else:
            wave += "x"
    return {"name": name, "wave": wave, "data": labels}


def _rendered(lines: list[dict[str, Any]], text: str, scale: int) -> str:
    source = {"signal": lines, "foot": {"text": text}, "config": {"hscale": scale}}
    drawing = str(wavedrom.render(json.dumps(source)).tostring())
    return drawing.replace("<svg ", '<svg style="background: white" ', 1) + "\n"  # on a dark page too


def blocks(figure: Figure, design: CoreDesign) -> None:
    """Draw the stages of a core between its streams, each with the words that it takes and gives."""
    axes = _empty(figure)
    stages = design.datapath.stages
    names = ["s_axis", *(stage.name for stage in stages), "m_axis"]
    words = [_words(design.datapath.inputs), *(_result_of(stage) for stage in stages)]
    _row(axes, names, words)


def _empty(figure: Figure) -> Axes:
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.grid(visible=False)
    return axes


def _words(ports: Sequence[Any]) -> str:
    return "\n".join(f"{port.name}: {port.bits} bits" for port in ports)


def _result_of(stage: Any) -> str:
    node = stage.graph.nodes[stage.graph.outputs[-1]]
    return f"{node.width} bits"


def _row(axes: Axes, names: Sequence[str], words: Sequence[str]) -> None:
    axes.set_xlim(0, len(names))
    axes.set_ylim(0, 1)
    for k, name in enumerate(names):
        is_stream = k in {0, len(names) - 1}
        colour = GREEN if is_stream else BLUE
        axes.text(
            k + 0.5,
            0.66,
            name.replace("_", "_\n", 1) if len(name) > 9 else name,
            ha="center",
            va="center",
            color=colour,
            bbox={"boxstyle": "round,pad=0.5" if is_stream else "square,pad=0.6", "fc": "white", "ec": colour},
        )
        if k + 1 < len(names):
            axes.annotate("", (k + 1.14, 0.66), (k + 0.86, 0.66), arrowprops={"arrowstyle": "->", "color": GREY})
            axes.text(k + 1, 0.16, words[k], ha="center", va="center", color=GREY, fontsize=8)


_BUS = ("SCK", "MOSI", "MISO")
_CONVERTERS = (("MCP3204", "voltages"), ("MAX31855", "channel 0"), ("MAX31855", "channel 1"))


def wiring(figure: Figure, board: str) -> None:
    """Draw how converters are wired to the header of a board: one bus, a chip select for each."""
    axes = _empty(figure)
    axes.set_xlim(0, 10)
    axes.set_ylim(0, 7.1)
    found = BOARDS[board]
    pins = dict(zip((*_BUS, *(f"CS{k}" for k in range(len(_CONVERTERS)))), found.header, strict=False))
    rows = {name: 6.2 - 0.9 * k for k, name in enumerate(pins)}
    axes.add_patch(Rectangle((0.2, 0.9), 2.1, 6.0, fc="white", ec=GREEN))
    axes.text(1.25, 6.65, found.title, ha="center", va="center", color=GREEN)
    for name, y in rows.items():
        axes.text(0.4, y, f"pin {pins[name]}", va="center", fontsize=8)
        axes.text(2.2, y, name, ha="right", va="center", fontsize=8)
    ends = dict[str, float]()
    for k, (device, what) in enumerate(_CONVERTERS):
        x = 3.5 + 2.2 * k
        axes.add_patch(Rectangle((x, 0.2), 1.7, 1.0, fc="white", ec=BLUE))
        axes.text(x + 0.85, 0.86, device, ha="center", va="center", color=BLUE)
        axes.text(x + 0.85, 0.45, what, ha="center", va="center", fontsize=8)
        wires = [name for name in (*_BUS, f"CS{k}") if not (device == "MAX31855" and name == "MOSI")]
        for place, name in enumerate(wires):
            ends[name] = at = x + 0.3 + 0.36 * place
            colour = RED if name.startswith("CS") else GREY
            axes.plot([at, at], [1.2, rows[name]], color=colour, lw=1)
            axes.plot(at, rows[name], "o", color=colour, ms=3)
    for name, y in rows.items():
        axes.plot([2.3, ends[name]], [y, y], color=RED if name.startswith("CS") else GREY, lw=1)


def _svg(size: tuple[float, float], paint: Callable[[Figure], None]) -> str:
    return picture("hardware", size, paint).decode()


def pictures() -> dict[str, str]:
    """Return the text of every picture by its path."""
    path = ROOT / "examples" / "flange_wear_locomotive.toml"
    text = path.read_text(encoding="utf-8").replace('"auto"', '"df1_ef2"', 1).replace('"auto"', '"parallel"', 1)
    instrument = design_core(from_text(text, path))
    return {
        f"{IMAGES}/streams.svg": streams(),
        f"{IMAGES}/reload.svg": reload(),
        f"{IMAGES}/blocks.svg": _svg((11, 1.3), lambda figure: blocks(figure, instrument)),
        f"{IMAGES}/wiring.svg": _svg((7.5, 4.2), lambda figure: wiring(figure, "ulx3s_25f")),
    }


def main() -> None:
    """Write or check the pictures."""
    made = pictures()
    if "--check" in sys.argv[1:]:
        stale = [name for name, text in made.items() if (ROOT / name).read_text(encoding="utf-8") != text]
        sys.exit(f"out of date: {', '.join(stale)}" if stale else 0)
    for name, text in made.items():
        (ROOT / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
