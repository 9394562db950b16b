"""Certificates of decimated filters: proven by the other method, and rejected when anything in them is not right."""

import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from tests.gen.word_lengths.decimated import locomotive, locomotive_text, read, tree_of

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.interface.certificate import Certificate
from sosmith.verify.certificate_file import DecimationEntry, on_grid
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.decimation import at_lower_rate, behind_decimator, folding_gain, remembered
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.verification import verify


def tree() -> Any:
    """Return the locomotive's certificate, to be changed."""
    return tree_of(locomotive())


def rejected(sentence: str) -> pytest.RaisesExc[RejectedError]:
    return pytest.raises(RejectedError, match=f"^{re.escape(sentence)}$")


@pytest.mark.slow
def test_the_locomotive_is_proven_again() -> None:
    made = locomotive()
    certificate = read(tree())
    verdict = verify(certificate)
    assert verdict.budget.keys() == made.quantized.budget.keys()
    for part, value in made.quantized.budget.items():
        assert -(2**-60) < value - verdict.budget[part] < 2**-16
    agreement = check_specification(certificate, locomotive_text(), verdict.margin)
    assert agreement.distance is not None
    assert agreement.distance < 2**-100
    held = locomotive_text(hold=True)
    assert check_specification(certificate, held, verdict.margin) == agreement


SCALED = """
name = "scaled"
sample_rate = 1000.0
input.x = { bits = 8, range = [0.0, 1.0] }
output = { bits = 12, signed = true, range = [-1.5, 1.5], unit = "", max_error = 0.09375 }
hardware.architecture = "parallel"
[filter]
family = "chebyshev1"
kind = "lowpass"
order = 1
cutoff = 53.8
passband_loss = 0.5
decimate = 2
"""


def test_bits_may_be_dropped_behind_a_decimator_and_before_an_input_stage(tmp_path: Path) -> None:
    """The parts of the budget have the order in which a sample meets what makes them."""
    path = tmp_path / "scaled.toml"
    path.write_text(SCALED, encoding="utf-8")
    made = design_core(load(path))
    assert [*made.quantized.budget][:2] == ["decimation", "input scaling"]
    assert [*verify(read(tree_of(made))).budget] == [*made.quantized.budget]


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_the_program_is_proven_from_the_text(architecture: str, tmp_path: Path) -> None:
    made = locomotive(architecture=architecture)
    generate(made, tmp_path)
    (tmp_path / "spec.toml").write_text(made.spec.text, encoding="utf-8")
    certificate = Certificate.load(tmp_path / f"{made.spec.name}.certificate.json")
    proof = certificate.verify(spec=tmp_path / "spec.toml", files=tmp_path, rebuild=True)
    assert made.architecture.program is not None
    assert proof.program is not None
    assert proof.program.instructions == len(made.architecture.program.instructions)
    assert proof.decimator is not None
    assert proof.decimator.registers == 8 + 8 * 4
    assert proof.files == proof.rebuilt == 5
    sentence = "the core must have one module flange_wear_locomotive_behind, not 0"
    with rejected(sentence):
        behind_decimator("module flange_wear_locomotive(aclk);\n  input aclk;\nendmodule\n", certificate.entries)


def third_band(tree: Any) -> Fraction:
    return Fraction(tree["decimation"]["aliasing"][2])


def folded_wrongly(tree: Any, by: Fraction) -> None:
    tree["decimation"]["aliasing"][2] = str(third_band(tree) + by)


WRONG: list[tuple[str, Callable[[Any], None], str]] = [
    (
        "registers a bit short",
        lambda tree: tree["decimation"].update(width=31),
        "the registers of the decimator must hold 0..4294901760, which 31 bits do not",
    ),
    (
        "a bit more dropped",
        lambda tree: tree["decimation"].update(dropped=11),
        "input x of start must take the range 0..2097151 and the format of what feeds it, not 0..4194303",
    ),
    (
        "a factor that is no power of two",
        lambda tree: tree["decimation"].update(factor=12),
        "the factor of the decimator must be a power of two, not 12",
    ),
    (
        "a stage less",
        lambda tree: tree["decimation"].update(stages=3),
        "aliasing from band 1 must be at most 8.13342e-05, not 3.52396e-06",
    ),
    (
        "less folds than can",
        lambda tree: folded_wrongly(tree, -Fraction(1, 2**64)),
        "aliasing from band 3 must be at most {third}, not {third}",
    ),
    (
        "more folds than can",
        lambda tree: folded_wrongly(tree, Fraction(1, 2**64)),
        "aliasing from band 3 must be at most {third}, not {third}",
    ),
    (
        "a band left out",
        lambda tree: tree["decimation"]["aliasing"].pop(),
        "aliasing must be given of 8 bands, not 7",
    ),
    (
        "a larger gain in a whole band",
        lambda tree: tree["decimation"]["bands"][3].update(gain="1/1000000"),
        "the largest gain from band 4 must be that at 173/4096 of the lower rate, 1.28263e-08, or little more, "
        "not 1e-06",
    ),
    (
        "another correction",
        lambda tree: tree["decimation"].update(correction="135/512"),
        "the correction of the droop must be the multiple of 1/1024 next to the best one, not 135/512",
    ),
    (
        "no correction in the filter",
        lambda tree: tree["ideal"]["sections"][-1].update(numerator=["1"]),
        "the last ideal section must be {gain} - {slope} / z, which corrects the droop",
    ),
    (
        "a rounding that costs nothing",
        lambda tree: tree["claims"]["budget"].pop("decimation"),
        "the parts of the budget must be decimation, filter coefficients, filter rounding, start, output rounding, "
        "not filter coefficients, filter rounding, start, output rounding",
    ),
    (
        "a pass band that folds onto itself",
        lambda tree: tree["decimation"].update(edge="1/32"),
        "the pass band must end below half the rate behind the decimator",
    ),
    (
        "no filter",
        lambda tree: tree["ideal"].update(sections=[]),
        "a decimator must have a filter behind it",
    ),
    (
        "two inputs",
        lambda tree: tree["inputs"].append(tree["inputs"][0]),
        "a decimator must have one input, not 2",
    ),
    (
        "too wide for a filter",
        lambda tree: tree["decimation"].update(width=43),
        "what leaves the decimator must have 2 to 32 bits, not 33",
    ),
]


@pytest.mark.parametrize(("change", "sentence"), [pytest.param(*case, id=subject) for subject, *case in WRONG])
def test_what_is_wrong_is_rejected(change: Callable[[Any], None], sentence: str) -> None:
    spoilt = tree()
    third = f"{float(third_band(spoilt)):.6g}"
    gain, slope = spoilt["ideal"]["sections"][-1]["numerator"]
    change(spoilt)
    with rejected(sentence.format(third=third, gain=gain, slope=slope[1:])):
        verify(read(spoilt))


@pytest.mark.slow
def test_a_smaller_part_of_the_budget_is_rejected() -> None:
    changed = tree()
    claimed = Fraction(changed["claims"]["budget"]["decimation"])
    changed["claims"]["budget"]["decimation"] = str(claimed / 2)
    with pytest.raises(RejectedError, match=r"^the part decimation of the budget must be "):
        verify(read(changed))


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (locomotive_text("8"), "the factor of the decimator must be 8 as specified, not 16"),
        (
            locomotive_text().replace('decimate = "auto"\n', ""),
            "the factor of the decimator must be 1 as specified, not 16",
        ),
        (
            locomotive_text().replace("0.2587802", "0.2587803"),
            "the edge of the pass band must be 2587803/1000000000 as specified, not 1293901/500000000",
        ),
    ],
)
def test_another_specification_is_rejected(text: str, sentence: str) -> None:
    certificate = read(tree())
    with rejected(sentence):
        check_specification(certificate, text, verify(certificate).margin)


@pytest.mark.parametrize(("factor", "stages", "results"), [(2, 1, 1), (2, 5, 3), (4, 3, 3), (4, 4, 3), (16, 4, 4)])
def test_results_that_depend_on_what_was_before_a_start(factor: int, stages: int, results: int) -> None:
    """Result n of N boxes of R samples in a row ends with sample n R, and begins N (R - 1) samples before."""
    assert remembered(DecimationEntry.model_construct(factor=factor, stages=stages)) == results
    assert sum(n * factor - stages * (factor - 1) < 0 for n in range(99)) == results


def test_a_filter_without_the_correction_is_not_the_stated_one() -> None:
    """Its factor is part of what the specification means at the lower rate."""
    changed = tree()
    changed["ideal"]["sections"].pop()
    with pytest.raises(RejectedError, match=r"^the filter must be the specified one within a peak gain of "):
        check_specification(read(changed), locomotive_text(), Fraction(1, 2**60))


def test_a_certificate_states_whole_bands() -> None:
    changed = tree()
    del changed["decimation"]["bands"]
    with pytest.raises(ValidationError, match=r"decimation\.bands\n  Field required"):
        read(changed)


def test_gains_are_rounded_up_to_the_grid() -> None:
    gain = folding_gain(2, 1, Fraction(1, 3))  # |cos(pi / 3)|
    assert gain == on_grid(Fraction(1, 2))
    assert at_lower_rate(read(tree())).inputs[0].bits == 22
