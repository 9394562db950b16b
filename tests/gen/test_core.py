"""The choice of a realization: the cheapest that is proven, its reason, and what is said where there is none."""

import re
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.architectures import search
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.realizations import kept_formats
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.specification.specification import Specification, from_text, from_tree, load
from sosmith.gen.word_lengths import selection
from sosmith.gen.word_lengths.cost import cost_of
from sosmith.gen.word_lengths.quantize import Plan, plan
from sosmith.model.errors import ShortfallError


@pytest.fixture(name="spec")
def low_pass() -> Specification:
    """Third-order low-pass at a thousandth of the sample rate, 8 bits out, in the parallel architecture."""
    audio = in_architecture("parallel", load(EXAMPLES / "audio_lowpass.toml"))
    output = replace(audio.output, bits=8, lsb=audio.output.lsb * 256)
    return replace(
        audio, output=output, max_error=output.lsb, filter=replace(audio.filter, order=3, cutoff=(Fraction(48),))
    )


def in_architecture(name: str, spec: Specification) -> Specification:
    return replace(spec, hardware=replace(spec.hardware, architecture=name))


def within(spec: Specification, beyond_half: Fraction) -> Specification:
    """Allow so much beside the half LSB of the output rounding."""
    return replace(spec, max_error=spec.output.lsb * (Fraction(1, 2) + beyond_half))


@pytest.mark.slow
def test_the_cheapest_is_taken_and_the_rest_are_told(spec: Specification) -> None:
    made = design_core(spec)
    areas = {name: cost_of(design_core(spec, realization=name).datapath).area for name in SECTIONS}
    best = made.quantized.realization
    assert areas[best] == min(areas.values())
    found = re.fullmatch(
        rf"{best}: the smallest estimated area of {len(areas)}, {round(areas[best]):,} LUT4 with a multiplier block "
        r"counted as 864 \((.*); more in multiplier blocks alone: (.*)\)",
        made.reasons["realization"],
    )
    assert found
    others = {name: int(area.replace(",", "")) for name, area in (entry.split() for entry in found[1].split(", "))}
    assert list(others.values()) == sorted(others.values())
    assert {*others, *found[2].split(", "), best} == areas.keys()


@pytest.mark.parametrize(
    ("order", "cutoff", "bits"),
    [
        (1, (12_000,), 4),  # nothing but powers of two
        (2, (4800,), 16),
        pytest.param(2, (2400, 4800), 12, marks=pytest.mark.slow),
        pytest.param(4, (480,), 16, marks=pytest.mark.slow),
        pytest.param(7, (124,), 16, marks=pytest.mark.slow),
    ],
)
def test_what_is_dropped_could_not_win(
    order: int, cutoff: tuple[int, ...], bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    audio = in_architecture("parallel", load(EXAMPLES / "audio_lowpass.toml"))
    kind = "lowpass" if len(cutoff) == 1 else "bandpass"
    output = replace(audio.output, bits=bits, lsb=Fraction(2, 1 << bits))
    asked = replace(audio.filter, order=order, kind=kind, cutoff=tuple(map(Fraction, cutoff)))
    spec = replace(audio, inputs=(replace(audio.inputs[0], bits=bits, lsb=output.lsb),), output=output)
    spec = replace(spec, max_error=output.lsb, filter=asked)
    made = design_core(spec)
    assert "more in multiplier blocks alone" in made.reasons["realization"]
    monkeypatch.setattr(search, "least_size", lambda ideal, name, objective: 0)
    every = design_core(spec)
    assert "more in multiplier blocks alone" not in every.reasons["realization"]
    assert made.quantized.realization == every.quantized.realization
    assert made.datapath == every.datapath


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["folded", "serial"])
def test_programs_have_an_objective_of_their_own(spec: Specification, architecture: str) -> None:
    asked = in_architecture(architecture, spec)
    made = design_core(asked)

    def length(of: CoreDesign) -> tuple[int, int, int]:
        program = of.architecture.program
        assert program is not None
        clocks = program.serial_cycles if architecture == "serial" else len(program.instructions)
        return clocks, program.words, program.accumulator_bits

    foldable = [name for name in SECTIONS if name not in {"normal", "lattice_wdf"}]
    lengths = {name: length(design_core(asked, realization=name)) for name in foldable}
    assert length(made) == min(lengths.values())
    clocks, words, bits = length(made)
    counted = f"the fewest clocks of multiplication of 6, at most {clocks}"
    if architecture == "folded":
        counted = f"the shortest program of 6, {clocks} instructions"
    start = f"{made.quantized.realization}: {counted}, {words} words of memory, an accumulator of {bits} bits (df"
    assert made.reasons["realization"].startswith(start)
    assert made.reasons["realization"].endswith("; not to be folded: normal, lattice_wdf)")
    # The word lengths of the smallest parallel core make no shorter program. Bits that take no clock lower the error.
    small = design_core(spec, realization=made.quantized.realization)
    other = replace(made, architecture=replace(made.architecture, datapath=small.datapath))
    assert length(other)[:2] >= length(made)[:2]
    assert made.quantized.bound < small.quantized.bound


@pytest.mark.slow
def test_each_architecture_tried_is_designed_for_itself(spec: Specification) -> None:
    fast = replace(spec, sample_rate=spec.hardware.clock, filter=replace(spec.filter, cutoff=(Fraction(48_000),)))
    tried = design_core(in_architecture("auto", fast))
    assert tried.architecture.name == "parallel"
    assert tried.datapath == design_core(fast).datapath
    assert tried.reasons["realization"] == design_core(fast).reasons["realization"]


@pytest.mark.slow
def test_what_was_dropped_is_planned_if_nothing_else_suits(
    spec: Specification, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = {"df1", "df1_ef1", "df1_ef2", "lattice_wdf"}
    fail(monkeypatch, dict.fromkeys(few, "it must fit, and does not"))
    assert design_core(spec).quantized.realization in SECTIONS.keys() - few


def test_those_that_fall_short_are_told(spec: Specification) -> None:
    assert design_core(within(spec, Fraction(1, 10**8))).reasons["realization"].endswith("; df1 and df2t fall short)")


def test_the_only_one_that_is_left(spec: Specification, monkeypatch: pytest.MonkeyPatch) -> None:
    fail(monkeypatch, {name: "it must fit, and does not" for name in SECTIONS if name != "delta"})
    monkeypatch.setattr(search, "least_size", lambda ideal, name, objective: 0)
    others = [name for name in SECTIONS if name != "delta"]
    reason = design_core(spec).reasons["realization"]
    assert re.fullmatch(
        r"delta: the only one proven, [0-9,]+ LUT4 with a multiplier block counted as 864 "
        rf"\({', '.join(others[:-1])} and {others[-1]} fall short\)",
        reason,
    )


def fail(monkeypatch: pytest.MonkeyPatch, sentences: dict[str, str]) -> None:
    """Have these realizations fall short."""

    def failing(**options: Any) -> Plan:
        if options["realization"] in sentences:
            raise ShortfallError(sentences[options["realization"]])
        return plan(**options)

    monkeypatch.setattr(search, "plan", failing)


def test_none_for_one_reason(spec: Specification) -> None:
    sentence = (
        f"none of the {len(SECTIONS)} realizations meets the specification: the filter's coefficients must keep "
        "their error below 5e-13 output LSB with 40 significant bits each, and do not: raise output.max_error, raise "
        "output.bits or decimate by 32 first, as the cutoff is 1/1000 of the sample rate"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        design_core(within(spec, Fraction(1, 10**12)))


def test_a_realization_that_falls_short_is_told_which_one_does_not() -> None:
    tree = {
        "name": "kept",
        "sample_rate": 1000,
        "input": {"x": {"bits": 8, "range": [-1, 1], "signed": True}},
        "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 1},
        "output": {"bits": 8, "range": [-1, 1], "signed": True, "max_error": Decimal("0.003906250078125")},
        "hardware": {"architecture": "parallel", "realization": "df1"},
    }
    sentence = (
        "the filter must keep its rounding error below 5e-09 output LSB with 40 fraction bits in each state, and does "
        "not: raise output.max_error, raise output.bits or decimate by 32 first, as the cutoff is 1/1000 of the sample "
        'rate; hardware.realization = "df1_ef2" meets the specification as it is'
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        design_core(from_tree(tree, Path("kept.toml")))


def test_none_for_several_reasons(spec: Specification, monkeypatch: pytest.MonkeyPatch) -> None:
    fail(monkeypatch, {name: f"the bound must hold for {name}, and does not" for name in SECTIONS})
    sentence = (
        f"none of the {len(SECTIONS)} realizations meets the specification: with df1_ef2, the bound must hold for "
        "df1_ef2, and does not"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(sentence)}$"):
        design_core(spec)


PROVEN = ["proof, df1_ef1", "proof, delta", "proof, df1_ef2"]
"""What the choice comes to for the specification below; the second one is taken."""


@pytest.fixture(name="tiny")
def small_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Specification:
    monkeypatch.setattr(kept_formats, "cache_folder", lambda: tmp_path)
    port = "bits = 10\nsigned = true\nrange = [-1.0, 1.0]"
    return from_text(
        f"""
        name = "tiny"
        sample_rate = 1.0
        [input.x]
        {port}
        [filter]
        family = "butterworth"
        kind = "lowpass"
        order = 2
        cutoff = 0.04
        [output]
        {port}
        max_error = "faithful"
        [hardware]
        architecture = "folded"
        clock = 1000.0
        """,
        Path("tiny.toml"),
    )


def designed(spec: Specification) -> tuple[CoreDesign, list[str]]:
    """Return a design, and which realizations were proven."""
    steps: list[str] = []
    made = design_core(spec, progress=steps.append)
    return made, [step for step in steps if step.startswith("proof")]


def test_the_one_taken_is_proven_again_and_no_other(tiny: Specification) -> None:
    first, proven = designed(tiny)
    assert (first.quantized.realization, proven) == ("delta", PROVEN)
    again, proven = designed(tiny)
    assert proven == PROVEN[1:2]
    assert (again.quantized, again.reasons, again.datapath) == (first.quantized, first.reasons, first.datapath)


def test_what_a_slower_clock_leaves_no_time_for_falls_short(
    tiny: Specification, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = designed(tiny)
    slow = replace(tiny, hardware=replace(tiny.hardware, clock=Fraction(first.architecture.clocks_per_sample)))
    kept, _ = designed(slow)
    monkeypatch.setattr(kept_formats, "cache_folder", lambda: None)
    searched, _ = designed(slow)
    assert kept.reasons == searched.reasons
    assert "fall short" in kept.reasons["realization"]
    assert "fall short" not in first.reasons["realization"]


@pytest.mark.parametrize("size", [1.0, 1e9])
def test_a_size_that_is_not_so_is_no_reason(size: float, tiny: Specification, monkeypatch: pytest.MonkeyPatch) -> None:
    right, _ = designed(tiny)
    monkeypatch.setattr(selection, "kept_or_made", lambda key, make, *_: size if key[0] == "proven" else make())
    made, proven = designed(tiny)
    assert sorted(proven) == sorted(PROVEN)
    assert (made.quantized, made.reasons) == (right.quantized, right.reasons)
