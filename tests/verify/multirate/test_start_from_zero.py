"""A decimator from a start at zero: nothing fills it, and it settles before its filter does."""

from dataclasses import replace

import pytest
from tests.formal.prover import broken
from tests.verify.multirate.decimators import (
    Case,
    Instrument,
    accepted,
    check_rejected_as_made,
    designed,
    written,
)

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.certificate import about, certificate
from sosmith.gen.word_lengths.settling import samples_to_settle, with_settling
from sosmith.hdl.decimation import channel_decimator, decimator
from sosmith.model.dataflow.c_model import c_header, c_source
from sosmith.verify.c_model.check import check_c_model
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.multirate.cic import check_decimator
from sosmith.verify.verification import verify

ONE = Case(start="zero")
CASES = [
    ONE,
    Case(start="zero", hold=False, architecture="folded"),
    Case(start="zero", channels=3, factor=8, hold=False),
    Case(start="zero", signed=False, factor=2, cutoff=20, error=0.02, architecture="serial"),
    Instrument(start="zero"),
    Instrument(start="zero", channels=2, factor=2),
]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("case", CASES)
def test_a_decimator_is_proven(case: Case | Instrument) -> None:
    _, made = designed(case)
    assert made.ideal.start is None
    check_decimator(written(case), made, case.channels)


@pytest.mark.slow
@pytest.mark.parametrize("case", [CASES[0], CASES[2], CASES[4]])
def test_every_edit_is_rejected(case: Case | Instrument) -> None:
    assert accepted(case) == set()


@pytest.mark.parametrize("case", [Case(), Case(start="zero")])
def test_one_start_is_not_the_other(case: Case) -> None:
    """The hardware of each is rejected with the certificate of the other."""
    other = case._replace(start="zero" if case.start == "steady" else "steady")
    with pytest.raises(RejectedError, match=r"^the registers around the core must be "):
        check_decimator(written(other), designed(case)[1])


BROKEN = [
    ("sums that a reset leaves", 'name=f"sum{k}", reset_less=reset_less', 'name=f"sum{k}", reset_less=True'),
    ("combs that a reset leaves", 'name=f"comb{k}", reset_less=reset_less', 'name=f"comb{k}", reset_less=True'),
    ("a sum that begins with 1", 'name=f"sum{k}", reset_less', 'name=f"sum{k}", init=1, reset_less'),
]


@pytest.mark.parametrize(("right", "wrong"), [pytest.param(*case, id=subject) for subject, *case in BROKEN])
def test_hardware_that_is_wrong_is_rejected(right: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_rejected_as_made(ONE, monkeypatch, decimator, "CicDecimator", broken(decimator, right, wrong).CicDecimator)


def test_states_of_channels_that_have_not_started_are_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    right, wrong = "state.eq(Mux(started, word.data, 0))", "state.eq(word.data)"
    check_rejected_as_made(
        CASES[2], monkeypatch, decimator, "ChannelDecimator", broken(channel_decimator, right, wrong).ChannelDecimator
    )


def with_flags(made: CoreDesign, samples: int) -> Certificate:
    """Certify a design that flags so many results after a start."""
    quantized = replace(made.quantized, datapath=with_settling(made.datapath, samples))
    return certificate(quantized, made.spec.max_error)


def test_it_settles_before_its_filter() -> None:
    made, _ = designed(ONE)
    cic, samples = made.datapath.decimator, made.quantized.settling
    assert cic is not None
    assert samples == samples_to_settle(made.datapath) + cic.remembered
    assert made.quantized.settling_of_input == 4 * samples
    verify(with_flags(made, samples))
    with pytest.raises(RejectedError, match=r"^another past must change the output by at most 1/2 LSB from sample "):
        verify(with_flags(made, samples - 2))


@pytest.mark.parametrize("case", [ONE, Instrument(start="zero")])
def test_the_c_model_starts_as_the_certificate_says(case: Case | Instrument) -> None:
    design, _ = designed(case)
    other, _ = designed(case._replace(start="steady"))
    made = certificate(design.quantized, design.spec.max_error, about(design, {}))
    assert made.about is not None
    assert made.about.item is not None
    item = made.about.item
    check_c_model(c_source(design.datapath), c_header(design.datapath), made, item)
    assert design.datapath.decimator is not None
    filled = replace(design.datapath, decimator=replace(design.datapath.decimator, steady=True))
    for source, header in ((design.datapath, filled), (filled, design.datapath), (other.datapath, other.datapath)):
        with pytest.raises(RejectedError):
            check_c_model(c_source(source), c_header(header), made, item)
