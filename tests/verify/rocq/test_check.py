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
from tests.verify.rocq.small import GRID, needs_coqc, small

from sosmith.gen.output.certificate import certificate
from sosmith.gen.realizations.registry import REALIZATIONS
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.rocq.check import check_in_rocq, rocq_texts, theorems
from sosmith.verify.rocq.flat import flattened
from sosmith.verify.rocq.kernel import STANDARD, THEORIES


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_every_code_and_the_error_bound(realization: str) -> None:
    verdict = check_in_rocq(small(realization))
    assert {"recursion_gain_0", "ranges_before", "every_code_in_range", "error_is_bounded"} <= verdict.claims.keys()
    assert set(verdict.axioms) <= STANDARD
    assert verdict.unchecked == (
        "parts of the error budget, each on its own",
        "the ideal filter: its coefficients are those of the certificate",
    )


def less_bound(tree: Any) -> None:
    """Claim less by more than what rounding up two parts of the budget may have added."""
    tree["claims"]["bound"] = str(Fraction(tree["claims"]["bound"]) - 3 * GRID)


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
    coefficients = tree["ideal"]["sections"][0]["denominator"]
    coefficients[1] = str(Fraction(coefficients[1]) + Fraction(1, 1 << 12))


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "name"),
    [
        (less_bound, "error_is_bounded"),
        (smaller_sum, "ranges_of_section_1|every_code_in_range"),
        (smaller_state, "ranges_of_section_1"),
        (other_product, "recursion_gain_1|peak_gain_1_0"),
        (other_filter, "error_is_bounded"),
    ],
)
def test_what_is_wrong_is_refused(edit: Callable[[Any], None], name: str) -> None:
    tree = json.loads(certificate_text(small()))
    edit(tree)
    with pytest.raises(RejectedError, match=f"^Rocq must accept (?:{name}) \\("):
        check_in_rocq(Certificate.model_validate(tree))


@needs_coqc
@pytest.mark.slow
@pytest.mark.parametrize("realization", ["df1", "df1_ef2", "lattice_wdf"])
def test_the_graph_in_rocq_computes_what_the_model_computes(realization: str, tmp_path: Path) -> None:
    quantized = plain(butterworth(3, 0.2), realization)
    made = certificate(quantized, quantized.datapath.output.lsb)
    for name, text in rocq_texts(made).items():
        (tmp_path / name).write_text(text)
    codes = np.random.default_rng(1).integers(-(1 << 15), 1 << 15, 40)
    graph = flattened(made)
    out = graph.offsets[-2] + made.stages[-1].outputs[0]
    inputs = "; ".join(f"({code})" for code in codes)
    (tmp_path / "Claims.v").write_text(
        (tmp_path / "Claims.v").read_text().partition("(* section 0: gain")[0]
        + f"Definition x (n p : nat) := nth n [{inputs}] 0.\n"
        + f"Eval vm_compute in map (fun n => nth {out} (run core x n) 0) (seq 0 {len(codes)}).\n"
    )
    for name in (*THEORIES, "Claims"):
        said = subprocess.run(
            ["coqc", "-Q", ".", "Sosmith", f"{name}.v"], cwd=tmp_path, capture_output=True, text=True, check=True
        )
    shown = [int(code) for code in re.findall(r"-?\d+", said.stdout.partition(":")[0])]
    assert shown == quantized.datapath.compute(codes.reshape(-1, 1)).ravel().tolist()


def test_what_no_theorem_is_about_is_named() -> None:
    assert theorems(small(steady=True))[2] == (
        "ranges: a filter that starts from its first sample",
        "error bound: no ranges are proven",
    )


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_theorems_are_the_same_on_every_run(realization: str) -> None:
    made = small(realization)
    texts = rocq_texts(made)
    assert texts == rocq_texts(made)
    assert texts["Claims.v"].count("Print Assumptions ") == len(theorems(made)[1])
