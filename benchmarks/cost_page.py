"""The document of costs, docs/cost.md, with its plot: made from the recorded figures only."""

from __future__ import annotations

import io
from dataclasses import replace

import matplotlib
from benchmarks.cost_cores import (
    ARCHITECTURES,
    EXAMPLES,
    FAST,
    GROWTH,
    MASKED,
    ONLINE,
    ORDER_SIX,
    PROTECTED,
    REALIZED,
    SEVERAL,
    TWO_PRODUCTS,
    Core,
    Figures,
    fmax,
    logic_of,
    missing,
    outdated,
    rate,
    recorded,
    targets_in,
    with_fewer_seeds,
)
from benchmarks.cost_estimate_record import recorded as estimated
from benchmarks.cost_estimate_record import section
from benchmarks.cost_goals import (
    AUDIO,
    goal_table,
    tries,
)
from benchmarks.firmware import recorded as firmware
from benchmarks.peers import PEERS, PUBLISHED
from benchmarks.silicon import table as silicon_table
from benchmarks.synthesis import GOAL, TARGETS, title
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sosmith.gen.picture import settled


def protection_table(record: Figures) -> str:
    """Return a Markdown table of the protected cores beside the plain ones."""
    lines = [
        "| core | `protect` | target | LC, or all LUT4 | FF | RAM | fmax, MHz | logic, more | fmax, more |",
        "|---" * 9 + "|",
    ]
    for bare in dict.fromkeys(replace(core, protect="none") for core in PROTECTED):
        for key in replace(bare, protect="detect").targets:
            base = targets_in(record, bare).get(key)
            for core in (bare, *(core for core in PROTECTED if replace(core, protect="none") == bare)):
                figures = targets_in(record, core).get(key)
                if base is None or figures is None or figures["cells"] is None:
                    continue
                area, logic, least = figures["area"], logic_of(key, figures), logic_of(key, base)
                more = "" if core == bare else f"{100 * (logic / least - 1):+.0f} %"
                slower = "" if core == bare else f"{100 * (fmax(figures) / fmax(base) - 1):+.0f} %"
                lines.append(
                    f"| {bare.label} | {core.protect} | {title(TARGETS[key])} | {logic:,} | {area['flip_flops']:,} "
                    f"| {area['rams']} | {fmax(figures):.1f} | {more} | {slower} |"
                )
    return "\n".join(lines)


def realized_table(record: Figures) -> str:
    """Return a Markdown table of the state space beside direct sections."""
    columns = (
        *("realization", "multipliers", "LUT4 alone", "all LUT4", "FF", "fmax, MHz (lowest to highest)"),
        *("clocks per sample", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for core in REALIZED:
        for figures in targets_in(record, core).values():
            area = figures["area"]
            row = [
                core.realization,
                str(area["multipliers"]),
                f"{area['luts']:,}",
                f"{area['all_luts']:,}",
                f"{area['flip_flops']:,}",
                f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
                str(figures["cycles"]),
                f"{1e6 * fmax(figures) / figures['cycles']:,.0f}",
            ]
            lines.append(f"| {' | '.join(row)} |")
    speed = {core.realization: fmax(targets_in(record, core)["ecp5"]) for core in REALIZED}
    beside = [
        f"{speed['state_space'] / speed[name]:.2f} times that of {name}" for name in speed if name != "state_space"
    ]
    return "\n".join(lines) + f"\n\nThe rate of state_space is {', '.join(beside)}."


def fast_table(record: Figures) -> str:
    """Return a Markdown table of the cores with look-ahead, and with several samples a clock, beside the plain one."""
    columns = (
        *("samples a clock", "pipeline", "realization", "target", "multipliers", "LUT4 alone", "all LUT4", "FF"),
        *("seeds", "fmax, MHz (lowest to highest)", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for core in (AUDIO["parallel"], *FAST):
        for key, figures in targets_in(record, core).items():
            if not key.startswith("ecp5") or figures["refusal"]:
                continue
            area = figures["area"]
            row = [
                str(core.lanes),
                f"look-ahead for {core.clock} MHz" if core.clock else "plain",
                figures["realization"],
                title(TARGETS[key]),
                str(area["multipliers"]),
                f"{area['luts']:,}",
                f"{area['all_luts']:,}",
                f"{area['flip_flops']:,}",
                str(len(figures["fmax"])),
                f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
                f"{rate(core, figures):,.0f}",
            ]
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def two_products_table(record: Figures) -> str:
    """Return a Markdown table of the folded cores with two products a clock, each beside the one with one."""
    columns = (
        *("core", "multipliers", "target", "LC, or all LUT4", "FF", "RAM", "fmax, MHz (lowest to highest)"),
        *("clocks per sample", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for two in TWO_PRODUCTS:
        for key, both in targets_in(record, two).items():
            one = targets_in(record, replace(two, multipliers=0)).get(key)
            lines += [_row(two.example, two, key, each) for each in (one, both) if each is not None]
    return "\n".join(lines)


def order_six_table(record: Figures) -> str:
    """Return a Markdown table of a filter of order six in all architectures that are measured for it."""
    columns = (
        *("architecture, proven to", "multipliers", "target", "all LUT4", "FF", "RAM"),
        *("fmax, MHz (lowest to highest)", "clocks per sample", "samples per second"),
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for core in ORDER_SIX:
        name = f"{core.architecture}, {core.lsb or 1} LSB"
        lines += [_row(name, core, key, each) for key, each in targets_in(record, core).items()]
    return "\n".join(lines)


def _row(name: str, core: Core, key: str, figures: Figures) -> str:
    area = figures["area"]
    row = [
        name,
        str(area["multipliers"]),
        title(TARGETS[key]),
        f"{logic_of(key, figures):,}",
        f"{area['flip_flops']:,}",
        str(area["rams"]),
        f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
        f"{figures['cycles']:,}",
        f"{rate(core, figures):,.0f}",
    ]
    return f"| {' | '.join(row)} |"


def masked_table(record: Figures) -> str:
    """Return a Markdown table of the family's filter for a mask, and of any inside it."""
    columns = (
        "filter",
        "target",
        "realization",
        "multipliers",
        "LC, or all LUT4",
        "FF",
        "fmax, MHz (lowest to highest)",
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for core in MASKED:
        for key, figures in targets_in(record, core).items():
            area = figures["area"]
            row = [
                "any inside the mask" if core.freedom == "mask" else "of the family",
                title(TARGETS[key]),
                figures["realization"],
                str(area["multipliers"]),
                f"{logic_of(key, figures):,}",
                f"{area['flip_flops']:,}",
                f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
            ]
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def online_table(record: Figures) -> str:
    """Return a Markdown table of the cores in on-line arithmetic beside those in the other architectures."""
    columns = (
        *("bits", "architecture", "target", "LC, or TRELLIS_COMB", "FF", "multipliers", "seeds"),
        *("fmax, MHz (lowest to highest)", "clocks per sample", "samples per second"),
        "logic for a million samples per second",
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for bits in (0, 24):
        for key in ONLINE[0].targets:
            for architecture in (*ARCHITECTURES, "online"):
                core = Core("audio_lowpass", architecture, bits=bits)
                figures = targets_in(record, core).get(key)
                if figures is None or figures["refusal"]:
                    continue
                area, speed = figures["area"], rate(core, figures)
                row = [
                    str(bits or 16),
                    architecture,
                    title(TARGETS[key]),
                    f"{figures['cells']:,}",
                    f"{area['flip_flops']:,}",
                    str(area["multipliers"]),
                    str(len(figures["fmax"])),
                    f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})",
                    f"{figures['cycles']:,}",
                    f"{speed:,.0f}",
                    f"{1e6 * figures['cells'] / speed:,.0f}",
                ]
                lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def table(record: Figures, keys: tuple[str, ...]) -> str:
    """Return a Markdown table of all cores on some targets of one family."""
    ecp5 = keys == ("ecp5",)
    cells = {
        ("ecp5",): "LUT4 alone | all LUT4 | TRELLIS_COMB | FF | MULT18X18D | DP16KD",
        ("gatemate",): "CPE_LT | FF | CC_MULT | CC_BRAM_20K",
    }.get(keys, "LC | FF | MAC16 | RAM")
    lines = [
        f"| core | architecture | channels | target | {cells} | fmax, MHz (lowest to highest) | clocks per sample "
        "| samples per second |",
        "|---" * (7 + cells.count("|") + 1) + "|",
    ]
    for core, key, figures in recorded(record, keys):
        area, cycles = figures["area"], figures["cycles"]
        logic = "-" if figures["cells"] is None else f"{figures['cells']:,}"
        counts = [logic, f"{area['flip_flops']:,}", str(area["multipliers"]), str(area["rams"])]
        counts = [f"{area['luts']:,}", f"{area['all_luts']:,}", *counts] if ecp5 else counts
        row = [core.example, core.architecture, str(core.channels), title(TARGETS[key]), *counts]
        if figures["refusal"]:
            row += ["does not fit", f"{cycles:,}", "-"]
        else:
            speed = f"{fmax(figures):.1f} ({min(figures['fmax']):.1f} to {max(figures['fmax']):.1f})"
            row += [speed, f"{cycles:,}", f"{1e6 * fmax(figures) / cycles:,.0f}"]
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def refusals(record: Figures) -> str:
    """List what does not fit: too many cells, or the message of the tool."""
    lines = "".join(
        f"- {core.label} on {title(TARGETS[key])}: {figures['refusal']}.\n"
        for core, key, figures in recorded(record, TARGETS)
        if figures["refusal"]
    )
    return f"Cores that do not fit, with cells after synthesis or the placer's message:\n\n{lines}" if lines else ""


def path_table(record: Figures) -> str:
    """Return a Markdown table of the slowest paths on the ECP5."""
    lines = ["| core | ns | the path, ns at each step |", "|---|---|---|"]
    for core, _, figures in recorded(record, ["ecp5"]):
        path = figures["path"]
        steps = ", ".join(f"{kind} {delay:.2f}" if delay else kind for kind, delay in path)
        lines.append(f"| {core.label} | {sum(delay for _, delay in path):.1f} | {steps} |")
    return "\n".join(lines)


def peer_table(record: Figures) -> str:
    """Return a Markdown table of the audio low-pass and other projects' filters."""
    lines = [
        "| project | design | LUT4 alone | LUT4 with carries | FF | MULT18X18D | fmax, MHz | largest error seen, LSB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for architecture in ("parallel", "folded"):
        figures = targets_in(record, AUDIO[architecture]).get("ecp5")
        if figures is None:
            continue
        area = figures["area"]
        lines.append(
            f"| this one | {architecture} | {area['luts']:,} | {area['all_luts']:,} | {area['flip_flops']:,} "
            f"| {area['multipliers']} | {fmax(figures):.1f} | at most 1, proven |"
        )
    for peer in PEERS:
        lines.append(
            f"| {peer.project} | {peer.what} | {peer.luts:,} | {peer.luts + 2 * peer.carries:,} "
            f"| {peer.flip_flops:,} | {peer.multipliers} | {peer.fmax:.1f} | {peer.error} |"
        )
    return "\n".join(lines)


def published_table() -> str:
    """Return a Markdown table of what other projects publish of theirs."""
    lines = [
        "| project | design | FPGA | LUT | FF | multipliers | fmax, MHz | samples per second, each channel | source |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for each in PUBLISHED:
        lines.append(
            f"| {each.project} | {each.what} | {each.fpga} | {each.luts:,} | {each.flip_flops:,} | {each.multipliers} "
            f"| {each.fmax} | {each.samples} | {each.source} |"
        )
    return "\n".join(lines)


def firmware_table() -> str:
    """Return a Markdown table of the C models on microcontrollers."""
    lines = ["| core | processor | instructions a sample | code, bytes |", "|---|---|---|---|"]
    lines += [
        f"| {each.example} | {each.core} | {each.instructions:.0f} | {each.code:,} |" for each in firmware().models
    ]
    return "\n".join(lines)


def plot(record: Figures) -> str:
    """Return an SVG of logic against samples per second and of logic against channels, one panel per target."""
    colours = dict(zip(EXAMPLES, ("C0", "C1", "C2"), strict=True))
    marks = dict(zip(ARCHITECTURES, ("o", "s", "^"), strict=True))
    panels = ("hx8k", "up5k", "ecp5")
    counts = sorted({1, *(core.channels for core in SEVERAL)})
    with matplotlib.rc_context({"svg.hashsalt": "sosmith", "svg.fonttype": "none"}):
        figure = Figure(figsize=(12, 8), layout="constrained")
        FigureCanvasSVG(figure)
        rows = figure.subplots(2, len(panels), sharex="row", sharey=True)
        for (rates, channels), key in zip(rows.T, panels, strict=True):
            lines: dict[Core, list[tuple[int, int]]] = {}
            for core, _, figures in recorded(record, [key]):
                if figures["refusal"]:
                    continue
                logic = logic_of(key, figures)
                lines.setdefault(replace(core, channels=1), []).append((core.channels, logic))
                if core.channels == 1:
                    rates.loglog(rate(core, figures), logic, marks[core.architecture], color=colours[core.example])
            for core, points in lines.items():
                style = f"{marks[core.architecture]}-"
                channels.loglog(*zip(*points, strict=True), style, color=colours[core.example], label=core.label)
            rates.set_title(title(TARGETS[key]))
            rates.set_xlabel("samples per second at fmax, one channel")
            channels.set_xlabel("channels")
            channels.set_xticks(counts, list(map(str, counts)))
            channels.xaxis.minorticks_off()
            for axes in (rates, channels):
                axes.set_ylabel("all LUT4" if key == "ecp5" else "logic cells")
                axes.grid(visible=True, which="both", alpha=0.3)
        rows[0, 0].set_ylim(bottom=100)
        handles = {
            label: handle for axes in rows[1] for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize="small")
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return settled(text.getvalue())


def document(record: Figures) -> dict[str, str]:
    """Return the texts of the document and its plot, by path from the root, from the recorded figures only."""
    found = (figures for core in record["cores"].values() for figures in core["targets"].values())
    realizations = sorted({figures["realization"] for figures in found})
    left = "".join(f"- {core}.\n" for core in missing(record))
    if left:
        left = f"\n## Not measured\n\n{left}"
    if earlier := "".join(f"- {core}.\n" for core in outdated(record)):
        left += f"\n## Measured on an earlier version of the core\n\n{earlier}"
    fewer = "".join(f"- {core}.\n" for core in with_fewer_seeds(record))
    if fewer:
        left += f"\n## Placed with fewer seeds, as each takes a quarter of an hour\n\n{fewer}"
    text = f"""# What the cores cost

Written by `python -m benchmarks.cost` from the figures that it records in `benchmarks/cost.json`. `--check` synthesizes
changed cores again and fails if a figure of synthesis has grown by more than {100 * (GROWTH - 1):.0f} %.

![logic against sample rate](images/cost.svg)

Measured are the filter core of audio_lowpass, and the whole instrument (calibration and filter) of the two other
examples, each in all three architectures, and some of them for several channels. Everything else is as specified,
including the proven bound.
The folded architecture has digits of 17 bits on the ECP5, whose multipliers have 18 bits, and of 15 elsewhere.
Not every core reaches the sample rate of its example with that many channels: the tables give the highest rate in
samples per second, of all channels together.
Realization, as `auto` chooses: {", ".join(realizations)}.

Tools: {", ".join(record["tools"])}.
fmax is the median of {len(record["seeds"])} seeds, with nextpnr asked for {GOAL} MHz. Clock and reset are the only
pins; the streams are kept, but end inside the FPGA. The pins of a package are therefore no limit here, and wires to
them are not timed. Nothing has run on a board. On a UP5K, paths through multiplier blocks count, which nextpnr leaves
out ([boards.md](boards.md#from-a-specification-to-a-live-value)); where its first router does not come to an end, the
second one routes.

How cells are counted:

- LC: logic cells as placed on an iCE40, each a LUT4 with a carry and a flip-flop. MAC16 is the multiplier block, which
  only the UP5K has; on the others, multipliers are built from logic cells.
- LUT4 alone: the LUT4 cells of Yosys on an ECP5. All LUT4: also each carry cell, CCU2C, as two, and each LUT RAM cell,
  TRELLIS_DPR16X4, as four. TRELLIS_COMB: LUT4 as placed, including those that only pass a signal through.
- CPE_LT: halves of programmable elements of a GateMate, as placed, each a LUT4 or a bit of a sum. CC_MULT is made of
  two for each 2 x 2 bits, and no block of its own.
- Multipliers, flip-flops (FF) and block RAMs (RAM of 4 kbit, DP16KD of 16 kbit) after synthesis.
- Clocks per sample: an upper limit in the serial architecture, where the number depends on the data.

## iCE40

{table(record, ("up5k", "hx8k", "hx1k"))}

{refusals(record)}
## ECP5

{table(record, ("ecp5",))}

The slowest path between registers, for the median seed; registers have the names that Yosys gives them:

{path_table(record)}

In the parallel architecture a section closes its recursion within one clock: sums, multiplication and state follow one
another without a register. With several channels the loop is pipelined across them.

## GateMate

audio_lowpass, one channel:

{table(record, ("gatemate",))}

Products by constants are sums here, with the same graph as on the HX8K. A signal waits for all rows of a CC_MULT, and
wires take most of the time: the placer asks for 200 MHz, and for none of these cores finds half of that.

## Two products a clock

`folded` with one multiplier and with `multipliers = 2` ([hardware.md](hardware.md#two-products-a-clock)), from the same
specification and with the same proven bound:

{two_products_table(record)}

On the ECP5 the registers at the multipliers and at the output of the program memory are inside the blocks
([hardware.md](hardware.md#registers-inside-blocks)).

## Three sections of second order

audio_lowpass with order 6 and 18 bits in and out, one channel:

{order_six_table(record)}

`multiplexed` has the hardware of one section, with one or more clocks a turn
([hardware.md](hardware.md#sections-that-take-turns)). For one LSB of 18 bits, coefficients are longer than the operands
of a multiplier block; for four they are not.

## Any filter inside a mask

The ports, the allowed error and the parallel architecture of audio_lowpass with the mask of
[a recipe](recipes/inside_a_mask.md), which order 5 meets: the Butterworth filter itself, and with `freedom = "mask"`:

{masked_table(record)}

## Digit by digit

The online architecture ([online.md](online.md)) beside the others: audio_lowpass, one channel, with 16 bits in and out
and with 24. A sample takes as many clocks with 24 bits as with 16. Here fmax is the median of as many seeds as the
table says.

{online_table(record)}

It stands between the others: for its samples per second it takes far less logic than serial, on the HX8K less than
folded too, and several times as much as parallel. A carry chain of an FPGA is faster than the steps that it saves,
and the units of a section that work side by side take more logic than one set of multipliers. No choice by `auto` falls
on it.

## Look-ahead, and several samples a clock

audio_lowpass with loops that go back several samples at once, and with beats of several samples
([hardware.md](hardware.md#look-ahead)). Products of look-ahead take multiplier blocks in pieces, as long as there are
any; the others are sums with registers between them. It looks as far ahead as the clock asks that it is designed for,
by an estimate.

{fast_table(record)}

Without look-ahead, the lanes of a beat wait for each other.

## State space beside direct sections

Hourani and others report twice the throughput for second-order sections in state space, on a Spartan-3, with nine
multipliers instead of five. In both loops stands one multiplication and about two additions. Here is audio_lowpass in
the parallel architecture on the ECP5, each realization with the word lengths that the same allowed error takes:

{realized_table(record)}

## Protection

What it costs to detect a wrong bit, or to correct one and detect two, as `[hardware] protect` asks
([hardware.md](hardware.md)):

{protection_table(record)}

The check bits stand between a memory and its logic, within the same clock; that is what lowers fmax.
{section(estimated())}
## Goals

The project's own goals. Where a goal says only "LUT4", both ways of counting are shown.

{goal_table(record)}

What was tried for missed goals, and the obstacle:
{tries(record)}

## Comparison with other projects

Fifth-order Butterworth low-pass at 1 kHz for 48 kHz, 16 bits in and out, on an ECP5. The others were measured for an
ECP5-85F, out of context, with Yosys 0.70, nextpnr-ecp5 and one seed. The comparison is not like for like:
widths, throughput and what can be changed at run time differ. LUT RAM is counted for this project only.

{peer_table(record)}

What these and another project publish of three sections, each in its own way of counting, with other filters and other
FPGAs; nothing is said of their errors:

{published_table()}

## Standard cells

The same cores mapped onto the standard cells OSU018, 180 nm, as `sosmith design --silicon osu018` does, by
`python -m benchmarks.silicon`: area in NANDs of two inputs and in mm2, and the clock of the slowest path between
registers, by OpenSTA for the typical corner. **This is before layout**: wires take no area and no time, and there is no
clock tree and no pad. Memories are made of flip-flops, programs of gates.

{silicon_table()}

`hardware.multipliers = 0` makes sums of products by constants.

## The same without an FPGA

The C model of each example gives the same codes on a microcontroller, with the same bound: [firmware.md](firmware.md).

{firmware_table()}
{left}"""
    return {"docs/cost.md": text, "docs/images/cost.svg": plot(record)}
