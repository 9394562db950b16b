"""Certificates of decimated instruments: the calibration in them is proven too, and rejected when it is not right."""

import copy
import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import pytest
from tests.gen.word_lengths.decimated import INSTRUMENT, locomotive, locomotive_text, read, small, tree_of
from tests.verify.multirate.decimators import Instrument, designed, written

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.output.verilog import core_verilog
from sosmith.gen.specification.specification import from_text
from sosmith.interface.certificate import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimation import calibration_alone, module_in
from sosmith.verify.program.check import check_program
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.verification import verify


def rejected(sentence: str) -> pytest.RaisesExc[RejectedError]:
    return pytest.raises(RejectedError, match=f"^{re.escape(sentence)}$")


@pytest.mark.slow
def test_the_locomotive_is_proven_again() -> None:
    made = locomotive(core="instrument")
    certificate = read(tree_of(locomotive(core="instrument")))
    verdict = verify(certificate)
    assert verdict.budget.keys() == made.quantized.budget.keys()
    for part, value in made.quantized.budget.items():
        assert -(2**-60) < value - verdict.budget[part] < 2**-16
    assert verdict.bound * made.datapath.output.lsb <= made.spec.max_error
    alone = calibration_alone(certificate)
    assert alone is not None
    assert verdict.budget["calibration"] == (
        verify(alone).bound * alone.output.lsb / certificate.output.lsb * (certificate.claims.peak_gain or 0)
    )
    agreement = check_specification(certificate, locomotive_text(), verdict.margin)
    assert (agreement.core, agreement.fitted) == ("instrument", False)
    assert agreement.distance is not None
    assert agreement.distance < 2**-100


@pytest.mark.slow
def test_a_result_that_leaves_as_it_is_given_is_found() -> None:
    case = Instrument(signed=True)
    alone = calibration_alone(designed(case)[1])
    assert alone is not None
    text = module_in(written(case), alone.name.removesuffix("_ahead"), alone.name)
    assert "reg [12:0] m_axis_tdata" in text
    assert check_program(text, alone).states == 0
    narrow = text.replace("[12:0] m_axis_tdata", "[11:0] m_axis_tdata")
    with pytest.raises(RejectedError, match=r"^the result must have room for .*, not 12 bits$"):
        check_program(narrow, alone)


@pytest.mark.slow
def test_both_programs_are_proven_from_the_text(tmp_path: Path) -> None:
    made = locomotive(architecture="folded", core="instrument")
    generate(made, tmp_path)
    (tmp_path / "spec.toml").write_text(made.spec.text, encoding="utf-8")
    certificate = Certificate.load(tmp_path / f"{made.spec.name}.certificate.json")
    proof = certificate.verify(spec=tmp_path / "spec.toml", files=tmp_path, rebuild=True)
    behind, ahead = made.architecture.program, made.architecture.calibration
    assert behind is not None
    assert ahead is not None
    assert ahead.program is not None
    assert proof.program is not None
    assert proof.calibration is not None
    assert proof.program.instructions == len(behind.instructions)
    assert proof.calibration.instructions == len(ahead.program.instructions)
    assert proof.decimator is not None
    assert proof.calibration.judged == ((0, 65535), (0, 65535))
    assert proof.files == proof.rebuilt == 5


@pytest.mark.slow
def test_another_program_of_the_calibration_is_rejected(tmp_path: Path) -> None:
    """Text and certificate are those of two cores, which differ in a coefficient of the calibration alone."""
    made = small("[hardware]\narchitecture = 'folded'\n")
    text = INSTRUMENT.replace("0.3672", "0.3673").format(extra="[hardware]\narchitecture = 'folded'\n")
    other = design_core(from_text(text, Path("slight.toml")))
    alone = calibration_alone(read(tree_of(made)))
    assert alone is not None
    assert check_program(module_in(core_verilog(made), made.datapath.name, alone.name), alone).instructions > 10
    with pytest.raises(RejectedError):
        check_program(module_in(core_verilog(other), other.datapath.name, alone.name), alone)


def calibration(tree: Any) -> Any:
    return tree["decimation"]["calibration"]


def of_budget(tree: Any, part: str, change: Fraction) -> None:
    """Change a part of the calibration's own budget, and the sum with it."""
    claims = calibration(tree)["claims"]
    claims["budget"][part] = str(Fraction(claims["budget"][part]) + change)
    claims["bound"] = str(Fraction(claims["bound"]) + change)


def limited(tree: Any) -> None:
    """Limit the result before the decimator to one code less than it can have."""
    last = calibration(tree)["stages"][-1]
    (index,) = last["outputs"]
    node = last["nodes"][index]
    last["nodes"].append({"op": "clamp", "operands": [index], "frac": 0, "low": node["low"], "high": node["high"] - 1})
    last["outputs"] = [len(last["nodes"]) - 1]


def coefficient(tree: Any) -> None:
    tree["ideal"]["polynomial"][1][0] = "3673/10000"


def told(value: Fraction) -> str:
    return f"{value} = {float(value):.6g}"


UNIT = Fraction(1, 2**64)


@dataclass(frozen=True)
class Numbers:
    """What the certificate of the small instrument claims, for the sentences about it."""

    tree: Any

    @cached_property
    def part(self) -> Any:
        return calibration(self.tree)

    @cached_property
    def own(self) -> Fraction:
        return Fraction(self.part["claims"]["budget"]["calibration"])

    @cached_property
    def whole(self) -> Fraction:
        return Fraction(self.tree["claims"]["budget"]["calibration"])

    @cached_property
    def gain(self) -> Fraction:
        return Fraction(self.tree["claims"]["peak_gain"])

    @cached_property
    def bits(self) -> int:
        return int(self.part["output"]["bits"])

    @cached_property
    def width(self) -> int:
        return int(self.tree["decimation"]["width"])

    @cached_property
    def last(self) -> Any:
        stage = self.part["stages"][-1]
        return stage["nodes"][stage["outputs"][0]]


@cache
def numbers() -> Numbers:
    return Numbers(tree_of(small()))


WRONG: list[tuple[str, Callable[[Any], object], Callable[[Numbers], str]]] = [
    (
        "a calibration that errs less than it does",
        lambda tree: of_budget(tree, "calibration", -UNIT),
        lambda n: f"the part calibration of the budget must be {told(n.own)}, not {told(n.own - UNIT)}",
    ),
    (
        "a port that is rounded to for nothing",
        lambda tree: of_budget(tree, "output rounding", -Fraction(1, 2)),
        lambda _: "the part output rounding of the budget must be 1/2 = 0.5, not 0 = 0",
    ),
    (
        "its error without the filter's gain",
        lambda tree: tree["claims"]["budget"].update(calibration=str(numbers().whole / numbers().gain)),
        lambda n: f"the part calibration of the budget must be {told(n.whole)}, not {told(n.whole / n.gain)}",
    ),
    (
        "its error left out",
        lambda tree: tree["claims"]["budget"].pop("calibration"),
        lambda n: (
            f"the parts of the budget must be {', '.join(n.tree['claims']['budget'])}, not "
            f"{', '.join(list(n.tree['claims']['budget'])[1:])}"
        ),
    ),
    (
        "a smaller gain of the filter",
        lambda tree: tree["claims"].update(peak_gain=str(numbers().gain - UNIT)),
        lambda n: f"the peak_gain of the filter must be {told(n.gain)}, not {told(n.gain - UNIT)}",
    ),
    (
        "limited before the decimator",
        limited,
        lambda _: "the calibration before the decimator must pass on all that it can give, not limit it",
    ),
    (
        "a port that is too narrow",
        lambda tree: calibration(tree)["output"].update(bits=numbers().bits - 1),
        lambda n: (
            f"the output must be whole codes in 0..{2 ** (n.bits - 1) - 1}, not in "
            f"{n.last['low']}..{n.last['high']} with 0 fraction bits"
        ),
    ),
    (
        "a port in other steps",
        lambda tree: calibration(tree)["output"].update(lsb=str(Fraction(numbers().part["output"]["lsb"]) * 2)),
        lambda _: "the part calibration of the budget must be 382492197/62500 = 6119.88, not 56169/62500 = 0.898704",
    ),
    (
        "a port with an offset",
        lambda tree: calibration(tree)["output"].update(zero="1"),
        lambda _: "the part output rounding of the budget must be 2049/2 = 1024.5, not 1/2 = 0.5",
    ),
    (
        "a port of another quantity",
        lambda tree: calibration(tree)["output"].update(unit="V"),
        lambda _: "the calibration must give mm, not V",
    ),
    (
        "another polynomial",
        coefficient,
        lambda _: "the part calibration of the budget must be 104919/62500 = 1.6787, not 56169/62500 = 0.898704",
    ),
    (
        "no polynomial",
        lambda tree: tree["ideal"].update(polynomial=None),
        lambda _: "a calibration before the decimator must have a polynomial",
    ),
    (
        "no calibration",
        lambda tree: tree["decimation"].pop("calibration"),
        lambda _: "a decimator must have one input, not 2",
    ),
    (
        "a polynomial of the only input behind the decimator",
        lambda tree: (tree["decimation"].pop("calibration"), tree["inputs"].pop()),
        lambda _: "the calibration must stand before the decimator",
    ),
    (
        "registers a bit short",
        lambda tree: tree["decimation"].update(width=numbers().width - 1),
        lambda n: (
            f"the registers of the decimator must hold 0..{(2**n.bits - 1) * 2 ** (n.width - n.bits)}, "
            f"which {n.width - 1} bits do not"
        ),
    ),
]


@pytest.mark.sweep(7)
@pytest.mark.parametrize(("change", "sentence"), [pytest.param(*case, id=subject) for subject, *case in WRONG])
def test_what_is_wrong_is_rejected(change: Callable[[Any], object], sentence: Callable[[Numbers], str]) -> None:
    tree = copy.deepcopy(numbers().tree)
    verify(read(tree))
    change(tree)
    with rejected(sentence(numbers())):
        verify(read(tree))


@pytest.mark.slow
def test_a_polynomial_other_than_specified_is_rejected() -> None:
    text = locomotive_text().replace("0.3672", "0.3673")
    with rejected("coefficient [1][0] of the calibration must be 3673/10000 as specified, not 459/1250"):
        check_specification(read(tree_of(locomotive(core="instrument"))), text, Fraction(1, 2**40))
