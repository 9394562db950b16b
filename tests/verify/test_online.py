"""Claims on sections in on-line arithmetic: made by one method, proven by another, and rejected when tampered with."""

import json
import re
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.core import design_core
from sosmith.gen.output.certificate import certificate
from sosmith.gen.proof.online import largest_increment, prove_residuals
from sosmith.gen.specification.specification import load
from sosmith.model.errors import ShortfallError
from sosmith.model.sections import online
from sosmith.model.sections.online import OnlineSchedule
from sosmith.verify.certificate_file import Certificate, certificate_text
from sosmith.verify.graph import RejectedError
from sosmith.verify.online import check_online
from sosmith.verify.start import section_alone
from sosmith.verify.verification import verify

REALIZATIONS = ("df1", "df1_ef1", "df1_ef2")


@cache
def text(realization: str) -> str:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    made = design_core(replace(spec, hardware=replace(spec.hardware, architecture="online", realization=realization)))
    return certificate_text(certificate(made.quantized, made.spec.max_error, online=made.architecture.online))


def tree(realization: str) -> Any:
    return json.loads(text(realization))


def check(found: Any) -> None:
    read = Certificate.model_validate(found)
    check_online(read, [section_alone(stage) for stage in read.stages if stage.role == "section"])


@pytest.mark.sweep(1)
@pytest.mark.parametrize("realization", REALIZATIONS)
def test_what_is_claimed_is_proven(realization: str) -> None:
    found = tree(realization)
    verify(Certificate.model_validate(found))
    claims = found["claims"]["online"]
    assert claims["interval"] <= 8
    assert all(0 < Fraction(claim["increment"]) <= Fraction(1, 4) for claim in claims["sections"])


def set_delay(claims: Any, *, by: int) -> None:
    claims["sections"][1]["delay"] += by


def set_delay_with_its_increment(claims: Any) -> None:
    claim = claims["sections"][1]
    claim["delay"] -= 1
    claim["increment"] = str(Fraction(claim["increment"]) * 2)


def set_leading(claims: Any) -> None:
    claims["sections"][1]["leading"] -= 2


def set_fraction(claims: Any) -> None:
    claims["sections"][1]["residual_frac"] -= 1


def set_increment(claims: Any) -> None:
    claims["sections"][1]["increment"] = "1/8"


def set_interval(claims: Any) -> None:
    claims["interval"] -= 1


def set_units(claims: Any) -> None:
    claims["units"] -= 1


def set_names(claims: Any) -> None:
    del claims["sections"][0]


TAMPERED = {
    "delay": (lambda claims: set_delay(claims, by=-1), r"^the largest increment of section1 must be "),
    "delay and increment": (
        set_delay_with_its_increment,
        r"^the residual of section1 must stay in \[-3/4, 3/4\), not ",
    ),
    "leading digit": (set_leading, r"^the residual of section1 must stay in \[-3/4, 3/4\), not "),
    "fraction bits": (set_fraction, r"^the residual of section1 must have more than \d+ fraction bits$"),
    "increment": (set_increment, r"^the largest increment of section1 must be \d+/\d+, not 1/8$"),
    "interval": (set_interval, r"^the interval must be at least 7 clocks for section1, not 6$"),
    "units": (set_units, r"^the units of section\d must have \d+ clocks for a sample, not 28$"),
    "names": (set_names, re.escape("units must be claimed of section0, section1, section2, not section1, section2")),
}


@pytest.mark.parametrize(("tamper", "message"), TAMPERED.values(), ids=TAMPERED)
def test_a_wrong_claim_is_rejected(tamper: Any, message: str) -> None:
    found = tree("df1")
    tamper(found["claims"]["online"])
    with pytest.raises(RejectedError, match=message):
        check(found)


def test_a_delay_too_short_for_the_last_steps_is_rejected() -> None:
    found = tree("df1_ef1")
    claim = found["claims"]["online"]["sections"][0]
    claim["delay"] = 2
    with pytest.raises(
        RejectedError, match=r"^all that enters section0 must do so before its last two steps: the delay"
    ):
        check(found)


def test_an_error_that_is_not_centred_is_rejected() -> None:
    found = tree("df1_ef1")
    stage = next(stage for stage in found["stages"] if stage["name"] == "section1")
    scales = [node for node in stage["nodes"] if node["op"] == "fraction"]
    for node in scales:
        node["op"], node["frac"], node["low"], node["high"] = "floor", node["parameter"], 0, 0
    with pytest.raises(RejectedError, match=r"^the (constant|error feedback) of section1 must "):
        check(found)


def test_the_proof_does_not_hold_for_a_delay_that_is_one_too_small(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = load(EXAMPLES / "audio_lowpass.toml")
    made = design_core(replace(spec, hardware=replace(spec.hardware, architecture="online", realization="df1")))
    right = made.architecture.online
    assert right is not None
    assert max(prove_residuals(right)) == max(map(largest_increment, right.sections)) <= Fraction(1, 4)
    monkeypatch.setattr(online, "MOST_INCREMENT", Fraction(1, 2))
    short = OnlineSchedule(tuple(replace(section) for section in right.sections), right.input_bits, right.lead_in)
    assert max(s.delay for s in short.sections) == max(s.delay for s in right.sections) - 1
    with pytest.raises(
        ShortfallError, match=r"^section1 must keep its residual in \[-3/4, 3/4\) with a delay of 3 digits"
    ):
        prove_residuals(short)
