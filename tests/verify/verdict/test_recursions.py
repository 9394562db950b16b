"""Names of realizations: each is true of its own structure only, down to its weights."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from flint import fmpq, fmpq_poly
from tests.verify.small_specifications import PLAIN

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.verify.certificate_file import Operation
from sosmith.verify.verdict import recursions
from sosmith.verify.verdict.recursions import Recursion, is_realized_as, recursions_of


def part(nodes: Any = (), **known: Any) -> Any:
    """Make a recursion of which so much is known already."""
    made = Recursion("section0", SimpleNamespace(nodes=nodes, outputs=(0,)))
    vars(made).update(known)
    return made


@pytest.mark.parametrize(
    ("weights", "feedback"),
    [
        ([-1], (0, 0)),
        ([-1, -2], (2, 0)),
        ([-1, -2, 1], (2, -1)),
        ([-2], None),
        ([-2, 1], None),
        ([-1, 0, 0, 1], None),
        ([-1, fmpq(1, 2)], None),
    ],
)
def test_error_feedback_has_two_whole_weights_at_most(weights: list[Any], feedback: tuple[int, int] | None) -> None:
    quantizer = SimpleNamespace(op=Operation.FLOOR, frac=8, operands=(0,))
    transfer = SimpleNamespace(undelayed=lambda index: (index, 0), numerator=lambda source, output: fmpq_poly(weights))
    assert part((quantizer,), transfer=transfer, is_direct=True).error_feedback == feedback


@pytest.mark.parametrize(
    ("weights", "names"),
    [
        (None, {"df1", "df1_ef1", "df1_ef2"}),
        ((0, 0), {"df1", "df1_ef1", "df1_ef2"}),
        ((1, 0), {"df1_ef1", "df1_ef2"}),
        ((-2, 1), {"df1_ef2"}),
        ((0, 1), {"df1_ef2"}),
        ((3, 0), set()),
        ((0, 2), set()),
    ],
)
def test_a_direct_form_has_no_more_feedback_than_its_name(weights: tuple[int, int] | None, names: set[str]) -> None:
    section = [part(loop=[0], is_direct=True, error_feedback=weights)]
    assert {name for name in ("df1", "df1_ef1", "df1_ef2") if is_realized_as(name, [section])} == names


def test_a_wave_digital_lattice_is_all_passes_and_a_sum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recursions, "_is_allpass", lambda each: each == "all-pass")
    yes: Any = ["all-pass"]
    assert is_realized_as("lattice_wdf", [yes, yes, []])
    assert not is_realized_as("lattice_wdf", [yes, yes])
    assert not is_realized_as("lattice_wdf", [yes, ["none"], []])
    assert not is_realized_as("lattice_wdf", [[]])


def test_a_state_space_section_is_nothing_else() -> None:
    spec = from_text(PLAIN + 'hardware.realization = "state_space"\n', Path("spec.toml"))
    made = design_core(spec)
    found = recursions_of(certificate(made.quantized, made.spec.max_error))
    names = ("state_space", "normal", "df2t", "delta", "df1_ef2", "look_ahead_2")
    assert [name for name in names if is_realized_as(name, found)] == ["state_space"]
