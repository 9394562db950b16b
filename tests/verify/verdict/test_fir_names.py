"""Names of the realizations of FIR filters: each is true of its own structure only, and the words must be kept to."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

import sosmith
from sosmith.model.errors import ShortfallError
from sosmith.verify.verdict.recursions import is_realized_as, recursions_of

TAPS = [0.1, -0.3, 0.6, -0.3, 0.1]
FORMS = ("fir_direct", "fir_symmetric", "fir_transposed")
TRUE = {(form, form) for form in FORMS} | {("fir_direct", "fir_symmetric")}
"""A direct form is a delay line whose products take sums of one, too."""


def spec(**keys: object) -> sosmith.Specification:
    made = sosmith.Specification.from_taps(TAPS, 1000.0, input_bits=8, architecture="parallel")
    return made.replaced(**keys)


@pytest.mark.sweep(8)
@pytest.mark.parametrize(
    ("form", "name"), list(product(FORMS, (*FORMS, "df1", "state_space", "lattice_wdf", "look_ahead_2")))
)
def test_a_name_is_true_of_its_own_structure(form: str, name: str) -> None:
    made = sosmith.design(spec(), realization=form)
    found = recursions_of(made.certificate.entries)
    general = {"df1", "state_space"}  # without a recursion, their structure is any
    assert is_realized_as(name, found) == ((form, name) in TRUE or name in general or name == "look_ahead_2")


@pytest.mark.parametrize("loss", [40.0, 60.0])
def test_a_designed_filter_must_keep_to_its_losses(tmp_path: Path, loss: float) -> None:
    table = {
        "family": "equiripple",
        "kind": "lowpass",
        "passband_edge": 100.0,
        "stopband_edge": 300.0,
        "passband_loss": 0.5,
        "stopband_loss": 40.0,
    }
    made = sosmith.design(spec(filter=table))
    path = tmp_path / "other.toml"
    path.write_text(spec(filter=table | {"stopband_loss": loss}).toml(), encoding="utf-8")
    if loss > 40:
        with pytest.raises(
            ShortfallError,
            match=r"the filter must keep to the edges and losses of the specification with symmetric taps$",
        ):
            made.certificate.verify(spec=path)
    else:
        proof = made.certificate.verify(spec=path)
        assert proof.agreement is not None
        assert proof.agreement.by_losses
        assert proof.scope["filter"].why == "it keeps to the edges and losses of the specification's words"


def test_other_taps_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(spec(filter={"taps": [*TAPS[:4], 0.1000001]}).toml(), encoding="utf-8")
    with pytest.raises(ShortfallError, match=r"the filter must be the specified one within a peak gain of"):
        sosmith.design(spec()).certificate.verify(spec=path)
