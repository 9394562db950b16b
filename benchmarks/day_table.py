"""What a table would cost in place of the polynomial: `python -m benchmarks.day_table`.

The day's curves of the bench's sensors, each as the polynomial that the hardware has for it and as a table with proven
interpolation, for the same errors allowed, costed by the same estimates. With --document, records it in
benchmarks/day_table.json and renews docs/day_table.md. Takes about two minutes.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from benchmarks.day_bench import MAX_ERROR, ORDER, RATE, SCENARIOS, SET_ERROR, TARGETS, calibrated
from benchmarks.day_table_page import page
from benchmarks.interpolated_table import Table, rows_of, smallest
from examples.wear_campaign import hardware
from examples.wear_campaign.bench import PAPER_FILTER

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.architectures.folded import Folded
from sosmith.gen.architectures.parallel import Parallel
from sosmith.gen.calibration.day_room import with_day_room
from sosmith.gen.core import design_core, polynomial_of
from sosmith.gen.estimate.estimate import estimated, on_board
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.reload.reload import check_swap, other_set
from sosmith.gen.specification.specification import Specification, load
from sosmith.gen.word_lengths.input_stage import normalised
from sosmith.instrument.scenarios.file import load_scenario
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.text_files import write_contents
from sosmith.terminal import show_progress

HERE = Path(__file__).parent
RECORD = HERE / "day_table.json"
PAGE = HERE.parent / "docs" / "day_table.md"

RUN, SENSORS, FIRST_SEED = "bench_43_50", 20, 39001
"""The scenario of docs/days.md in whose curves the highest order is needed most, and the first of its seeds."""

ALLOWED = {"1 LSB": None, "as on the bench": Fraction(str(MAX_ERROR)), "half a target's uncertainty": Fraction(1, 100)}
"""Errors in mm that the calibration is allowed by itself; None is the output's LSB."""

ROOMS = (None, Fraction(1, 2), Fraction(1))
"""Room in mm that hardware for other curves is designed with."""

SHORT_FILTER = hardware.filter_by_order(2, 0.5)
"""A filter behind the calibration, where room for other curves is costed with one."""

BOARD = "ulx3s_25f"
"""Its FPGA is that of explorations, and has block RAMs of 18 kbit and multipliers of 18 bits."""

SHAPES = ((512, 36), (1024, 18), (2048, 9), (4096, 4), (8192, 2), (16384, 1))
"""Words and bits of a block RAM of ECP5 (DP16KD; Lattice FPGA-TN-02204, memory usage guide)."""

KINDS: dict[str, type[Architecture]] = {"folded": Folded, "parallel": Parallel}


def curves() -> Iterator[Polynomial]:
    """Yield the day's curve of each sensor that needs the highest order, after five targets on the morning."""
    scenario = load_scenario(SCENARIOS / f"{RUN}.toml")
    for seed in range(FIRST_SEED, FIRST_SEED + SENSORS):
        _, made = calibrated(scenario, seed, TARGETS["five"])
        polynomial = made.fit.polynomial
        if polynomial.orders != (ORDER, 1):
            raise ShortfallError(f"the curve of seed {seed} must be of orders {ORDER}, 1, not {polynomial.orders}")
        yield polynomial


def specification(polynomial: Polynomial, folder: Path, behind: str = PAPER_FILTER) -> Specification:
    """Return the specification of hardware that is reloadable, with a curve, and a filter behind it."""
    table = hardware.calibration_table(polynomial)
    return load(hardware.specification(folder, "day", RATE, table, behind, reload=True, max_error=MAX_ERROR))


def block_rams(depth: int, width: int) -> int:
    """Return how many block RAMs a memory takes, in the best of their shapes."""
    return min(-(-depth // words) * -(-width // bits) for words, bits in SHAPES)


def products(datapath: Datapath) -> int:
    """Return how many values are multiplied by another one: in hardware whose coefficients are loaded, all of them."""
    return sum(node.op in {Op.MULTIPLY, Op.SCALE} for stage in datapath.stages for node in stage.graph.nodes)


def hardware_costs(datapath: Datapath) -> dict[str, Any]:
    """Return what each architecture makes of a datapath on the board: size by the estimate, and clocks of a sample."""
    found: dict[str, Any] = {"products": products(datapath)}
    board = find_board(BOARD)
    for name, kind in KINDS.items():
        architecture = on_board(kind(datapath, reload=True), board)
        estimate = estimated(architecture, board)
        assert estimate is not None, "the board's family is estimated"
        found[name] = {
            "luts": estimate.luts,
            "memory": estimate.memory_bits,
            "flip_flops": estimate.flip_flops,
            "blocks": estimate.multiplier_blocks,
            "words": architecture.bank_size[0],
            "clocks": architecture.cycles_per_result,
        }
    return found


def of_polynomial(spec: Specification) -> dict[str, Any]:
    """Return what the polynomial of a specification costs, each architecture with formats of its own."""
    found: dict[str, Any] = {}
    for name in KINDS:
        own = replace(spec, hardware=replace(spec.hardware, architecture=name))
        core = design_core(own, core="calibration", board=find_board(BOARD))
        costs = hardware_costs(core.datapath)
        found |= {name: costs[name], "products": costs["products"]}
        found[name]["bound"] = float(core.quantized.bound * core.datapath.output.lsb)
    return found


def of_table(table: Table, spec: Specification) -> dict[str, Any]:
    """Return what a table costs: its memory, and the arithmetic behind it."""
    voltage, temperature = spec.inputs
    datapath, board = table.datapath((voltage, temperature), spec.output), find_board(BOARD)
    fixed = estimated(on_board(Folded(datapath), board), board)
    assert fixed is not None, "the board's family is estimated"
    # One sample a clock reads all values of a segment at once: neighbours lie in memories of their own.
    each = -(-table.depth // (table.degree + 1))
    width = sum(table.widths)
    return {
        **hardware_costs(datapath),
        "fixed_program": fixed.luts,
        "segments": 1 << table.exponent,
        "frac": table.frac,
        "bits": table.bits,
        "block_rams": block_rams(table.depth, width),
        "block_rams_at_once": (table.degree + 1) * block_rams(each, width),
        "reload_words": table.reload_words,
        "missed": float(table.missed),
        "bound": float(table.bound * spec.output.lsb),
    }


def normalised_curve(spec: Specification) -> tuple[tuple[Fraction, ...], ...]:
    """Return the curve of a specification in output LSBs, for codes that are read as fractions."""
    polynomial, _ = polynomial_of(spec)
    return normalised(polynomial, spec.inputs, spec.output)


def one_curve(polynomial: Polynomial, folder: Path) -> list[dict[str, Any]]:
    """Return the figures of one curve, one row for each error allowed and way."""
    spec = specification(polynomial, folder)
    rows = rows_of(normalised_curve(spec))
    found = []
    for name, given in ALLOWED.items():
        allowed = spec.output.lsb if given is None else given
        same = replace(spec, max_error=allowed)
        found.append({"allowed": name, "way": "polynomial", **of_polynomial(same)})
        for degree, way in ((1, "linear"), (2, "quadratic")):
            table = smallest(rows, degree, allowed / spec.output.lsb)
            found.append({"allowed": name, "way": way, **of_table(table, same)})
    return found


def with_room(
    polynomials: list[Polynomial], folder: Path, room: Fraction | None, *, filtered: bool = False
) -> dict[str, Any]:
    """Return what parallel hardware for each curve costs, and how many sets of the other curves it refuses.

    With `filtered` it is that for the first curve only, with a filter behind it.
    """
    luts, blocks, refused, reasons = list[int](), list[int](), 0, set[str]()
    made = polynomials[:1] if filtered else polynomials
    for own in made:
        spec = specification(own, folder)
        ports = [(port.zero, port.zero + port.lsb * 2**port.bits) for port in spec.inputs]
        designed = own if room is None else with_day_room(own, ports, room)[0]
        spec = specification(designed, folder, SHORT_FILTER if filtered else PAPER_FILTER)
        spec = replace(spec, hardware=replace(spec.hardware, architecture="parallel"))
        core = design_core(spec, core="instrument" if filtered else "calibration", board=find_board(BOARD))
        estimate = estimated(core.architecture, find_board(BOARD))
        assert estimate is not None, "the board's family is estimated"
        luts.append(estimate.luts)
        blocks.append(estimate.multiplier_blocks)
        for other in polynomials:
            try:
                check_swap(core, None, other_set(core, polynomial=other, max_error=SET_ERROR))
            except ShortfallError as error:
                refused += 1
                reasons.add(re.sub(r"-?\d+", "N", str(error)))
    return {
        "room": None if room is None else float(room),
        "filtered": filtered,
        "luts": sorted(luts),
        "blocks": sorted(blocks),
        "sets": len(made) * len(polynomials),
        "refused": refused,
        "reasons": sorted(reasons),
    }


def measured() -> dict[str, Any]:
    """Return the record."""
    with tempfile.TemporaryDirectory() as folder, show_progress() as step:
        found = list[list[dict[str, Any]]]()
        polynomials = list(curves())
        for number, polynomial in enumerate(polynomials):
            step("curve", number, SENSORS)
            found.append(one_curve(polynomial, Path(folder)))
        spec = specification(polynomials[0], Path(folder))
        step("room", 0, len(ROOMS))
        rooms = [
            with_room(polynomials, Path(folder), room, filtered=filtered)
            for filtered in (False, True)
            for room in ROOMS
        ]
    lsb = spec.output.lsb
    allowed = {name: float(lsb if given is None else given) for name, given in ALLOWED.items()}
    return {
        "curves": found,
        "rooms": rooms,
        "allowed": allowed,
        "lsb": float(lsb),
        "order": ORDER,
        "first_seed": FIRST_SEED,
    }


def main() -> None:
    """Measure; print JSON, or renew the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.day_table", description=__doc__)
    parser.add_argument("--document", action="store_true", help=f"record, and renew docs/{PAGE.name}")
    parser.add_argument("--recorded", action="store_true", help="do not measure: renew the page from the record")
    arguments = parser.parse_args()
    found = json.loads(RECORD.read_text(encoding="utf-8")) if arguments.recorded else measured()
    text = json.dumps(found, indent=1) + "\n"
    if not (arguments.document or arguments.recorded):
        print(text, end="")
        return
    write_contents(HERE, {RECORD.name: text.encode()})
    write_contents(PAGE.parent, {PAGE.name: page(found).encode()})


if __name__ == "__main__":
    main()
