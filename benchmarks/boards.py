"""Builds bitstreams of the examples and records what they take of each board: `python -m benchmarks.boards`.

What was built goes to benchmarks/boards.json as it comes, and into the tables of docs/boards.md; what is there already
is left out. `--again` builds everything anew. `--page` builds nothing: it only writes the tables again. With `--check`,
what is recorded is built a second time, and a bitstream that differs in one byte is a failure.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import Any

import sosmith
from sosmith.gen.fpga.audio_clock import audio_pll
from sosmith.gen.fpga.boards import BOARDS, BUILDABLE, PROJECTS, RATE
from sosmith.hdl.bus.link import LEDS
from sosmith.model.converters.i2s_converter import I2S_CONVERTERS
from sosmith.model.converters.i2s_frame import I2sFrame
from sosmith.model.converters.spi_converter import CONVERTERS, ReadingFault
from sosmith.model.converters.spi_dac import DAC_FRAME_BITS, SPI_DACS

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "benchmarks" / "boards.json"
DOCUMENT = ROOT / "docs" / "boards.md"
DESIGNS = (
    ("flange_wear_locomotive", 1),
    ("flange_wear_locomotive", 12),
    ("flange_wear_bench", 1),
    ("audio_lowpass", 1),
)
"""Examples and their numbers of channels."""

MEASURED = ("icebreaker", "icestick", "ice40_hx8k_b_evn", "ulx3s_25f", "tang_nano_9k", "olimex_gatemate")
"""Boards to build for; the other ones have FPGAs of the same families, which are as large or larger."""

AUDIO = ("recipes/live", 2)
"""The example with audio converters."""

BUILDS = (
    *((*design, board) for design in DESIGNS for board in MEASURED),
    *((*AUDIO, board) for board in ("icebreaker", "ulx3s_25f", "tang_nano_9k")),
)
"""Examples, their numbers of channels and boards, in the order of the tables."""

_CELLS = {
    "ice40": ("ICESTORM_LC", "ICESTORM_DSP", "ICESTORM_RAM"),
    "ecp5": ("TRELLIS_COMB", "MULT18X18D", "DP16KD"),
    "gowin": ("LUT4", None, "BSRAM"),
    "gatemate": ("CPE_LT", None, "RAM_HALF"),
}
"""Kinds of logic, multipliers and block RAM in the placer's words, by family."""

PARTS = {
    name: re.compile(rf"(?<=<!-- {name} -->\n).*?(?=<!-- end of {name} -->)", re.DOTALL)
    for name in ("boards", "headers", "converters", "dacs", "audio", "audio pins", "audio clocks", "faults", "built")
}


def built(example: str, channels: int, board: str) -> dict[str, Any]:
    """Build a bitstream; return what is recorded of it."""
    told = {"example": example, "channels": channels, "board": board}
    spec = tomllib.loads((ROOT / "examples" / f"{example}.toml").read_text(encoding="utf-8"))
    before = os.times()
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = sosmith.design({**spec, "channels": channels}, board=board).build(board, folder=folder)
        except sosmith.ShortfallError as error:
            return {**told, "shortfall": str(error)}
        bitstream = hashlib.sha256(made.bitstream.read_bytes()).hexdigest()
    seconds = sum(os.times()[:4]) - sum(before[:4])
    summary = made.summary
    kept = ("architecture", "clock_hz", "line_rate_baud", "samples_per_second", "clocks", "passed", "tools", "design")
    used = {kind: cells for kind, cells in summary["utilisation"].items() if cells["used"]}
    return {
        **told,
        **{key: summary[key] for key in kept},
        "utilisation": used,
        "rate": spec["sample_rate"],
        "bitstream_sha256": bitstream,
        "processor_seconds": round(seconds, 1),
    }


def differences(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Build what is recorded a second time; return sentences on what is not as it was."""
    found = []
    for row in rows:
        name = f"{row['example']}, {row['channels']} channels, {row['board']}"
        again = built(row["example"], row["channels"], row["board"])
        same = again.get("bitstream_sha256") == row.get("bitstream_sha256")
        print(f"{name}: {'the same bitstream' if same else 'another bitstream'}", flush=True)
        if not same:
            found.append(f"{name}: the bitstream must be the one recorded, byte for byte, not another one")
    return found


def board_table() -> str:
    """Return the boards and their pins, as the platforms know them, in Markdown."""
    rows = [
        "| board | `--board` | FPGA | clock, MHz | rx, tx of the serial line | LEDs | highest rate, Mbaud | loader |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in (*BUILDABLE, *PROJECTS):
        board = BOARDS[name]
        assert board.platform is not None
        module, _, kind = board.platform.partition(":")
        resources = {(one.name, one.number): one for one in getattr(import_module(module), kind).resources}
        line = {part.name: part.ios[0].names[0] for part in resources["uart", 0].ios if hasattr(part, "ios")}
        leds = [resources["led", k].ios[0].names[0] for k in range(LEDS) if ("led", k) in resources]
        cells = (
            board.title,
            f"`{name}`",
            board.device.title,
            f"{board.clock / 1e6:g}",
            f"{line['rx']}, {line['tx']}",
            ", ".join(leds),
            f"{board.clock / 4e6:g}",
            f"`openFPGALoader -b {board.loader}`" if board.loader else "Vivado",
        )
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def converter_table() -> str:
    """Return the converters, in Markdown."""
    rows = [
        "| converter | `device` | reading | channels each | SCK, MHz, at most | from 5 V on | clocks of a frame |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, converter in CONVERTERS.items():
        kind = f"{converter.width} bits" + (", signed" if converter.signed else "")
        cells = (
            converter.title,
            f"`{name}`",
            kind if converter.step is None else f"{kind}, {float(converter.step):g} degC",
            str(converter.inputs),
            f"{float(converter.timing.clock) / 1e6:g}",
            f"{float(converter.fast.clock) / 1e6:g}",
            str(converter.bits),
        )
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def header_table() -> str:
    """Return the pins for converters on each board, in Markdown."""
    rows = ["| board | SCK | MOSI | MISO | chip selects |", "|---|---|---|---|---|"]
    for board in BOARDS.values():
        if board.header:
            sck, mosi, miso, *selects = board.header
            rows.append(f"| {board.title} | {sck} | {mosi} | {miso} | {', '.join(selects)} |")
    return "\n".join(rows) + "\n"


def dac_table() -> str:
    """Return the DACs on an SPI, in Markdown."""
    rows = ["| DAC | `device` | words | SCK, MHz, at most | clocks of a frame |", "|---|---|---|---|---|"]
    for name, device in SPI_DACS.items():
        rows.append(
            f"| {device.title} | `{name}` | {device.width} bits | {float(device.timing.clock) / 1e6:g} "
            f"| {DAC_FRAME_BITS} |"
        )
    return "\n".join(rows) + "\n"


def audio_table() -> str:
    """Return the audio converters, in Markdown."""
    rows = ["| converter | `device` | | MCLK / sample rate: sample rates, kHz |", "|---|---|---|---|"]
    for name, device in I2S_CONVERTERS.items():
        kinds: dict[str, list[int]] = {}
        for ratio, rates in device.ratios:
            text = ", ".join(f"{low / 1000:g} to {high / 1000:g}" for low, high in rates)
            kinds.setdefault(text, []).append(ratio)
        allowed = "; ".join(f"{', '.join(map(str, ratios))}: {text}" for text, ratios in kinds.items())
        rows.append(f"| {device.title} | `{name}` | {'DAC' if device.is_dac else 'ADC'} | {allowed} |")
    return "\n".join(rows) + "\n"


def audio_pin_table() -> str:
    """Return the pins for audio converters on each board, in Markdown."""
    rows = [
        "| board | MCLK, LRCK, BCLK, data of the DAC | MCLK, LRCK, BCLK, data of the ADC | further data |",
        "|---|---|---|---|",
    ]
    for board in BOARDS.values():
        if board.audio:
            parts = (board.audio[:4], board.audio[4:8], board.audio[8:])
            rows.append(f"| {board.title} | {' | '.join(', '.join(part) for part in parts)} |")
    return "\n".join(rows) + "\n"


def audio_clock_table() -> str:
    """Return what boards make of 48 kHz, in Markdown."""
    rows = [
        "| board | its clock, MHz | clock of the design, MHz | MCLK, MHz | sample rate, Hz | ppm |",
        "|---|---|---|---|---|---|",
    ]
    pair, wanted = [I2S_CONVERTERS["pcm1808"], I2S_CONVERTERS["pcm5102a"]], Fraction(48_000)
    for board in BOARDS.values():
        if not board.audio:
            continue
        try:
            pll = audio_pll(board, pair, wanted)
        except sosmith.SpecificationError:
            rows.append(f"| {board.title} | {board.clock / 1e6:g} | not within 1 % | | | |")
            continue
        clock = Fraction(board.clock) if pll is None else pll.clock
        frame = I2sFrame.of(pair, clock=clock, sample_rate=wanted)
        figures = (board.clock, clock, clock * frame.ratio / frame.clocks)
        cells = [*(f"{float(hertz) / 1e6:.6g}" for hertz in figures), f"{float(clock / frame.clocks):,.2f}"]
        rows.append(f"| {board.title} | {' | '.join(cells)} | {1e6 * float(frame.deviation(clock, wanted)):+,.0f} |")
    return "\n".join(rows) + "\n"


def fault_list() -> str:
    """Return what a reading may be wrong with, in Markdown."""
    return "".join(f"- {fault.meaning};\n" for fault in ReadingFault).removesuffix(";\n") + ".\n"


def built_table(record: Sequence[dict[str, Any]]) -> str:
    """Return what the designs take of the boards, in Markdown."""
    rows = [
        "| example | channels | board | architecture | logic | multipliers | block RAM | fmax, MHz | required "
        "| samples/s a channel | required | to build, s of processor time |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in record:
        board = BOARDS[row["board"]]
        head = (row["example"], str(row["channels"]), board.title)
        if "shortfall" in row:
            rows.append(
                f"| {' | '.join(head)} | does not fit: {row['shortfall'].partition(', but: ')[2]} | | | | | | | | |"
            )
            continue
        cells = [_share(row["utilisation"].get(kind)) for kind in _CELLS[board.device.family]]
        slowest = min(row["clocks"], key=lambda clock: clock["achieved_mhz"] / clock["wanted_mhz"])
        timing = (f"{slowest['achieved_mhz']:.1f}", f"{slowest['wanted_mhz']:g}")
        rates = (f"{row['samples_per_second']:,.0f}", f"{row['rate']:,.0f}", f"{row['processor_seconds']:.0f}")
        rows.append(f"| {' | '.join((*head, row['architecture'], *cells, *timing, *rates))} |")
    tools = sorted({f"{name} {version}" for row in record for name, version in row.get("tools", {}).items()})
    return "\n".join(rows) + f"\n\nTools: {', '.join(tools)}. Line rate: {RATE:,} baud.\n"


def _share(cells: dict[str, int] | None) -> str:
    return "0" if cells is None else f"{cells['used']:,} of {cells['available']:,}"


def read() -> list[dict[str, Any]]:
    """Read the record, in the order of the tables."""
    rows = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else []
    order = {build: k for k, build in enumerate(BUILDS)}
    return sorted(rows, key=lambda row: order[row["example"], row["channels"], row["board"]])


def write(rows: Sequence[dict[str, Any]]) -> None:
    """Write the record."""
    RECORD.write_text("".join(["[\n", ",\n".join(json.dumps(row) for row in rows), "\n]\n"]), encoding="utf-8")


def renew() -> None:
    """Write the tables of the document."""
    text = DOCUMENT.read_text(encoding="utf-8")
    made = {
        "boards": board_table,
        "headers": header_table,
        "converters": converter_table,
        "dacs": dac_table,
        "audio": audio_table,
        "audio pins": audio_pin_table,
        "audio clocks": audio_clock_table,
        "faults": fault_list,
    }
    for name, table in made.items():
        text = PARTS[name].sub(lambda _, table=table: table(), text)
    DOCUMENT.write_text(PARTS["built"].sub(lambda _: built_table(read()), text), encoding="utf-8")


def main() -> None:
    """Build what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--again", action="store_true", help="build everything anew")
    parser.add_argument("--page", action="store_true", help="build nothing")
    parser.add_argument("--check", action="store_true", help="build a second time, and compare")
    asked = parser.parse_args()
    if asked.check:
        sys.exit("\n".join(differences(read())) or None)
    rows = [] if asked.again else read()
    there = {(row["example"], row["channels"], row["board"]) for row in rows}
    for example, channels, board in () if asked.page else BUILDS:
        if (example, channels, board) not in there:
            print(f"{example}, {channels} channels, {board}", flush=True)
            rows.append(built(example, channels, board))
            write(rows)
    renew()


if __name__ == "__main__":
    main()
