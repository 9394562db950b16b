"""All theorems of a certificate: ranges of all nodes, and the error bound; refused when anything is wrong."""

import json
import re
import subprocess
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.word_lengths.filters import butterworth, plain
from tests.verify.rocq.small import (
    BOTH,
    DECIMATED,
    DOWNSAMPLED,
    GRID,
    SETTLING,
    calibrated,
    checked,
    coarse,
    designed,
    from_zero,
    library,
    needs_coqc,
    small,
)

from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.port import Port
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError, inputs_of
from sosmith.verify.rocq.check import GIVEN, check_in_rocq, head, rocq_texts, theorems
from sosmith.verify.rocq.flat import flattened, used_inputs
from sosmith.verify.rocq.kernel import ACCEPTED, STANDARD, Accepted


@needs_coqc
def test_a_small_filter(tmp_path: Path) -> None:
    assert checked(small(order=1, steady=True), tmp_path) <= STANDARD


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("steady", [False, True])
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_code_and_the_error_bound(realization: str, steady: bool, tmp_path: Path) -> None:
    made = small(realization, steady=steady)
    assert checked(made, tmp_path) <= STANDARD
    assert theorems(made).unchecked == ()


@needs_coqc
@pytest.mark.slow
def test_a_branch_that_a_section_only_passes_on(tmp_path: Path) -> None:
    made = small("lattice_wdf", order=5)
    passed = [
        stage.name for stage in made.stages if set(stage.outputs) & set(inputs_of(stage)) - set(used_inputs(stage))
    ]
    assert passed
    assert checked(made, tmp_path) <= STANDARD


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("steady", [False, True])
def test_an_input_with_fewer_bits_than_the_output(steady: bool, tmp_path: Path) -> None:
    assert checked(coarse(steady=steady), tmp_path) <= STANDARD


@needs_coqc
@pytest.mark.slow
def test_a_calibration_before_the_filter(tmp_path: Path) -> None:
    assert checked(calibrated(), tmp_path) <= STANDARD


@needs_coqc
@pytest.mark.slow
def test_the_verdict() -> None:
    verdict = check_in_rocq(small(order=1))
    assert {"recursion_gain_0", "every_code_in_range", "error_in_parts", "error_is_bounded"} <= verdict.claims.keys()
    assert set(verdict.axioms) <= STANDARD
    assert (verdict.given, verdict.unchecked) == (GIVEN, ())


def less_bound(tree: Any) -> None:
    """Claim one unit of the grid less."""
    tree["claims"]["bound"] = str(Fraction(tree["claims"]["bound"]) - GRID)


def less_rounding(tree: Any) -> None:
    """Claim one unit less of a part of the budget, and of their sum."""
    less_bound(tree)
    tree["claims"]["budget"]["filter rounding"] = str(Fraction(tree["claims"]["budget"]["filter rounding"]) - GRID)


def more_rounding(tree: Any) -> None:
    """Claim one unit more than follows."""
    for claims, name in ((tree["claims"], "bound"), (tree["claims"]["budget"], "filter rounding")):
        claims[name] = str(Fraction(claims[name]) + GRID)


def less_allowed(tree: Any) -> None:
    """Allow less than the bound."""
    tree["max_error"] = str(Fraction(tree["claims"]["bound"]) * Fraction(tree["output"]["lsb"]) - GRID)


def wider_sum(tree: Any) -> None:
    """Let a sum's range end one code later."""
    next(node for node in tree["stages"][-1]["nodes"] if node["op"] == "add")["high"] += 1


def other_scale(tree: Any) -> None:
    """Let the codes of the input mean something else."""
    tree["inputs"][0]["lsb"] = str(Fraction(tree["inputs"][0]["lsb"]) * 2)


def smaller_sum(tree: Any) -> None:
    """Let a sum's range end one code earlier than that of its operands."""
    next(node for node in tree["stages"][1]["nodes"] if node["op"] == "add")["high"] -= 1


def smaller_state(tree: Any) -> None:
    """Let the range that rests on a peak gain be half as wide."""
    node = [node for node in tree["stages"][1]["nodes"] if node["op"] == "bound"][-1]
    node["high"] //= 2


def other_product(tree: Any) -> None:
    """Multiply by another coefficient."""
    next(node for node in tree["stages"][1]["nodes"] if node["op"] == "scale")["parameter"] += 1


def other_filter(tree: Any) -> None:
    """Compare with another filter."""
    coefficients = next(one["denominator"] for one in tree["ideal"]["sections"] if len(one["denominator"]) > 1)
    coefficients[1] = str(Fraction(coefficients[1]) + Fraction(1, 1 << 12))


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "name"),
    [
        (less_bound, "bound_is_sum_of_parts"),
        (less_rounding, "error_in_parts"),
        (more_rounding, "error_in_parts"),
        (less_allowed, "error_is_allowed"),
        (smaller_sum, "ranges_are_tight_"),
        (wider_sum, "ranges_are_tight_"),
        (smaller_state, "ranges_of_section_0|ranges_are_tight_"),
        (other_product, "recursion_gain_0|peak_gain_0_0"),
        (other_filter, "error_in_parts"),
        (other_scale, "calibrated_input|error_in_parts"),
    ],
)
def test_what_is_wrong_is_refused(edit: Callable[[Any], None], name: str, tmp_path: Path) -> None:
    tree = json.loads(certificate_text(small(steady=True)))
    edit(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept (?:{name}) \\("):
        checked(Certificate.model_validate(tree), tmp_path)


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "name"), [(less_rounding, "error_in_parts"), (other_scale, "calibrated_input|error_in_parts")]
)
def test_what_is_wrong_behind_an_input_of_few_bits_is_refused(
    edit: Callable[[Any], None], name: str, tmp_path: Path
) -> None:
    tree = json.loads(certificate_text(coarse(steady=True)))
    edit(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept (?:{name}) \\("):
        checked(Certificate.model_validate(tree), tmp_path)


@pytest.mark.slow
@needs_coqc
def test_a_first_section_that_uses_the_first_sample_is_refused(tmp_path: Path) -> None:
    tree = json.loads(certificate_text(small(order=1, steady=True)))
    nodes = tree["stages"][1]["nodes"]
    change, held = (at for at, node in enumerate(nodes) if node["op"] == "input")
    next(node for node in nodes if node["op"] == "delay" and node["operands"] == [change])["operands"] = [held]
    made = Certificate.model_validate(tree)
    assert theorems(made).ended == "the first section must use one input behind a start, not 2"
    with pytest.raises(RejectedError, match=r"^Rocq must accept ranges_are_tight_ \("):
        checked(made, tmp_path)


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1", "df1_ef2", "lattice_wdf"])
def test_the_graph_in_rocq_computes_what_the_model_computes(realization: str, tmp_path: Path) -> None:
    quantized = plain(butterworth(3, 0.2), realization)
    made = certificate(quantized, quantized.datapath.output.lsb)
    library(tmp_path)
    codes = np.random.default_rng(1).integers(-(1 << 15), 1 << 15, 40)
    graph = flattened(made)
    out = graph.offsets[-2] + made.stages[-1].outputs[0]
    inputs = "; ".join(f"({code})" for code in codes)
    (tmp_path / "Claims.v").write_text(
        head()
        + theorems(made).definitions
        + f"Definition x (n p : nat) := nth n [{inputs}] 0.\n"
        + f"Eval vm_compute in map (fun n => nth {out} (run core x n) 0) (seq 0 {len(codes)}).\n"
    )
    said = subprocess.run(
        ["coqc", "-Q", ".", "Sosmith", "Claims.v"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    shown = [int(code) for code in re.findall(r"-?\d+", said.stdout.partition(":")[0])]
    assert shown == quantized.datapath.compute(codes.reshape(-1, 1)).ravel().tolist()


SHIFTED = """
name = "shifted"
sample_rate = 1.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { taps = [0.5] }
output = { bits = 16, range = [-0.59, 15.41], unit = "", max_error = "faithful" }
"""
"""All codes of the output are further off by one amount, as its range begins between two of them; none is rounded."""


def test_what_no_theorem_is_about_is_named() -> None:
    assert theorems(designed(SETTLING)).unchecked == theorems(designed(DECIMATED)).unchecked == ()
    tree = json.loads(certificate_text(designed(BOTH)))
    tree["decimation"]["calibration"]["output"]["zero"] = "1"
    assert theorems(Certificate.model_validate(tree)).unchecked == (
        "error bound: the decimator takes values of which 0 has another code than 0",
        "what folds into the pass band at the decimator",
    )
    assert theorems(designed(SHIFTED)).unchecked == ("error bound: its output is not rounded",)


def test_a_theorem_that_cannot_be_written_is_asked_for_and_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    made = small()
    flagged = made.model_copy(update={"claims": made.claims.model_copy(update={"settling": 9})})
    why = "output_stage must have a code and a flag as outputs, not 1"
    assert (theorems(flagged).ended, theorems(made).ended) == (why, None)
    assert "peak_gain_1_0, error_is_bounded)." in rocq_texts(flagged)["Claims.v"]
    monkeypatch.setattr("sosmith.verify.rocq.check.run_kernel", lambda *_: Accepted("8.16", ()))
    with pytest.raises(RejectedError, match=f"^{why}$"):
        check_in_rocq(flagged)

    def refuse(*_: object) -> Accepted:
        raise RejectedError("Rocq must accept something")

    monkeypatch.setattr("sosmith.verify.rocq.check.run_kernel", refuse)
    with pytest.raises(RejectedError, match=f"^Rocq must accept something; {why}$"):
        check_in_rocq(flagged)
    with pytest.raises(RejectedError, match=r"^Rocq must accept something$"):
        check_in_rocq(made)


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [SETTLING, DECIMATED, BOTH, from_zero(DECIMATED), from_zero(BOTH)],
    ids=["from zero", "decimated", "calibrated, decimated", "decimated, from zero", "both, from zero"],
)
def test_a_start_from_zero_and_a_decimator(text: str, tmp_path: Path) -> None:
    made = designed(text)
    names = {claim.name for claim in theorems(made).claims}
    assert names >= ({"flagged", "settled"} if text == SETTLING else {"decimated_within", "calibrated_input"})
    assert checked(made, tmp_path) <= STANDARD


@pytest.mark.slow
@needs_coqc
def test_results_of_an_fir_filter_that_decimates(tmp_path: Path) -> None:
    made = designed(DOWNSAMPLED)
    assert made.downsampling is not None
    written = {claim.name: claim.text for claim in theorems(made).claims}["results_are_bounded"]
    assert f"code core (filled {made.downsampling.filled} x)" in written
    assert f"({made.downsampling.filled} + 2 * n)" in written
    assert "(from_first (fun n => calibrated (x n))) y" in written
    assert checked(made, tmp_path) <= STANDARD


@needs_coqc
@pytest.mark.slow
def test_a_window_that_is_not_filled_is_refused(tmp_path: Path) -> None:
    tree = json.loads(certificate_text(designed(DOWNSAMPLED)))
    tree["downsampling"]["filled"] -= 1
    with pytest.raises(RejectedError, match=r"^Rocq must accept results_are_bounded \("):
        checked(Certificate.model_validate(tree), tmp_path)


def sooner(tree: Any) -> None:
    """Claim one sample less."""
    tree["claims"]["settling"] -= 1


def narrower(tree: Any) -> None:
    """Let the words of the decimator be too short."""
    tree["decimation"]["width"] -= 1


def less_decimation(tree: Any) -> None:
    """Claim one unit less for the rounding of the filter behind the decimator."""
    less_bound(tree)
    budget = tree["claims"]["budget"]
    budget["filter rounding"] = str(Fraction(budget["filter rounding"]) - GRID)


def less_before(tree: Any) -> None:
    """Claim less of the calibration before the decimator."""
    claims = tree["decimation"]["calibration"]["claims"]
    claims["bound"] = str(Fraction(claims["bound"]) - GRID)


def other_polynomial(tree: Any) -> None:
    """Compare with another calibration."""
    tree["ideal"]["polynomial"][1][0] = "1/2"


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "edit", "name"),
    [
        (SETTLING, sooner, "flagged"),
        (DECIMATED, narrower, "ranges_are_tight_"),
        (DECIMATED, less_decimation, "error_in_parts"),
        (BOTH, less_before, "ahead_is_bounded"),
        (BOTH, other_polynomial, "ahead_is_bounded"),
    ],
)
def test_what_is_wrong_before_the_filter_is_refused(
    text: str, edit: Callable[[Any], None], name: str, tmp_path: Path
) -> None:
    tree = json.loads(certificate_text(designed(text)))
    edit(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept {name} \\("):
        checked(Certificate.model_validate(tree), tmp_path)


@pytest.mark.sweep(1)
@needs_coqc
@pytest.mark.parametrize("signed", [False, True])
def test_the_decimator_in_rocq_computes_what_the_model_computes(signed: bool, tmp_path: Path) -> None:
    port = Port(name="x", bits=6, signed=signed, lsb=Fraction(1), zero=Fraction(0))
    model = Decimator(input=port, factor=4, stages=3, dropped=2)
    codes = np.random.default_rng(2).integers(-32 if signed else 0, 32 if signed else 64, 45)
    library(tmp_path)
    inputs = "; ".join(f"({code})" for code in codes)
    shape = f"Decimator {model.factor} {model.stages} {model.width} {model.dropped} {str(signed).lower()}"
    (tmp_path / "Claims.v").write_text(
        head()
        + f"Definition x (n : nat) := nth n [{inputs}] 0.\n"
        + f"Eval vm_compute in map (decimate ({shape}) x) (seq 0 {model.count(len(codes))}).\n"
    )
    said = subprocess.run(
        ["coqc", "-Q", ".", "Sosmith", "Claims.v"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    shown = [int(code) for code in re.findall(r"-?\d+", said.stdout.partition(":")[0])]
    assert shown == model.compute(codes).tolist()


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_theorems_are_the_same_on_every_run(realization: str) -> None:
    made = small(realization)
    texts = rocq_texts(made)
    assert texts == rocq_texts(made)
    assert texts["Claims.v"].count(ACCEPTED) == len(theorems(made).claims)
    assert texts["Claims.v"].count("Print Assumptions all_claims") == 1
