"""Specifications of chains: what each table becomes, and every refusal word for word."""

from __future__ import annotations

import copy
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import sosmith
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT
from sosmith.model.errors import SpecificationError

TREE: dict[str, Any] = {
    "name": "rx",
    "sample_rate": 8000.0,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "stage": [
        {"name": "slow", "kind": "cic", "order": 2, "decimate": 4},
        {"name": "half", "kind": "halfband", "passband_edge": 300.0, "passband_loss": 0.1, "stopband_loss": 40.0},
        {"name": "low", "kind": "iir", "family": "butterworth", "order": 2, "cutoff": 200.0, "decimate": 2},
        {"name": "amp", "kind": "gain", "factor": -1.5},
    ],
    "output": {"bits": 10, "range": [-1.0, 1.0], "signed": True},
}


def loaded(change: Callable[[dict[str, Any]], object] = lambda tree: None) -> sosmith.ChainSpecification:
    tree = copy.deepcopy(TREE)
    change(tree)
    return sosmith.ChainSpecification.load(tree)


def test_each_stage_becomes_a_specification_of_its_own() -> None:
    spec = loaded()
    assert spec.stages == ("slow", "half", "low", "amp")
    assert spec.factor == 8
    tables = {stage.name: stage.tables["filter"] for stage in spec.checked.stages}
    assert [float(tap) * 16 for tap in tables["slow"]["taps"]] == [1, 2, 3, 4, 3, 2, 1]
    assert tables["half"]["stopband_edge"] == 700
    assert tables["half"]["kind"] == tables["low"]["kind"] == "lowpass"
    assert [stage.rate for stage in spec.checked.stages] == [8000, 2000, 2000, 1000]
    assert spec.checked.edge == 200
    assert tables["amp"]["taps"] == [Fraction(-3, 2)]


def test_text_and_keys_read_back_the_same(tmp_path: Path) -> None:
    spec = loaded()
    assert sosmith.ChainSpecification.load(spec.as_dict()).checked.stages == spec.checked.stages
    (tmp_path / "rx.toml").write_text(spec.toml(), encoding="utf-8")
    assert spec.toml().count("[[stage]]\n") == 4
    assert sosmith.ChainSpecification.load(tmp_path / "rx.toml").checked.stages == spec.checked.stages


def stage(k: int, **keys: Any) -> Callable[[dict[str, Any]], object]:
    """Return a change of a stage; None takes a key away."""

    def change(tree: dict[str, Any]) -> None:
        tree["stage"][k] |= keys
        tree["stage"][k] = {key: value for key, value in tree["stage"][k].items() if value is not None}

    return change


def hardware(**keys: Any) -> Callable[[dict[str, Any]], object]:
    return lambda tree: tree.update(hardware=keys)


REFUSED: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "interpolate": (
        stage(0, interpolate=2),
        "stage[0].interpolate must be left out beside decimate: a stage that interpolates and one that decimates in "
        "series do both, not 2",
    ),
    "interpolate poles": (
        stage(2, interpolate=2),
        "stage[2].interpolate must be left out in a stage of the kind iir: between samples, fir, halfband, cic fill "
        "in, not 2",
    ),
    "interpolate too much": (
        stage(0, decimate=None, interpolate=65),
        "stage[0].interpolate must be a whole number from 2 to 64, not 65",
    ),
    "interpolate by 3": (
        stage(0, decimate=None, interpolate=3),
        "stage[0].interpolate must be a power of two for a CIC filter, whose weights are then exact, not 3",
    ),
    "registers of the chain": (
        lambda tree: tree.setdefault("hardware", {}).update(reload=True, reload_registers=False),
        "hardware.reload_registers must be left out with [[stage]], as every stage has its own, not false",
    ),
    "unknown key": (
        stage(3, order=2),
        "stage[3].order must be one of the keys name, kind, architecture, realization, multipliers, protect, reload, "
        "reload_lock, factor in a stage of the kind gain, not an unknown one",
    ),
    "kind": (
        stage(0, kind="fft"),
        "stage[0].kind must be one of polynomial, gain, iir, fir, halfband, cic, auto, not 'fft'",
    ),
    "polynomial": (
        stage(1, kind="polynomial", passband_edge=None, passband_loss=None, stopband_loss=None),
        "stage[1].kind must be another kind after the first stage, as the gain of a polynomial differs from value to "
        "value, not 'polynomial'",
    ),
    "auto": (
        stage(2, decimate="auto"),
        "stage[2].decimate must be a whole number in a stage, as the rates of the stages after it follow from it, not "
        "'auto'",
    ),
    "cic without": (
        stage(0, decimate=None),
        "stage[0].decimate must be given for a CIC filter, or interpolate, not missing",
    ),
    "by 3 before poles": (
        stage(2, decimate=3),
        "stage[2].decimate must be a power of two from 2 to 1024 for a filter with poles, not 3",
    ),
    "no factor": (stage(3, factor=None), "stage[3].factor must be a number other than 0, not missing"),
    "a factor of 0": (stage(3, factor=0.0), "stage[3].factor must be a number other than 0, not 0.0"),
    "no number": (stage(3, factor="x"), "stage[3].factor must be a number other than 0, not 'x'"),
    "no edge": (
        stage(1, passband_edge=None),
        "stage[1].passband_edge must be given for a half-band filter, not missing",
    ),
    "no filter": (
        lambda tree: tree["stage"].append({"name": "last", "kind": "fir"}),
        "stage[4] must be given by passband_edge, stopband_edge, passband_loss and stopband_loss, or by one of taps "
        "and taps_file, not by none of them",
    ),
    "no kind": (
        stage(0, kind=None),
        "stage[0].kind must be one of polynomial, gain, iir, fir, halfband, cic, auto, not missing",
    ),
    "no order": (stage(0, order=None), "stage[0].order must be given for a CIC filter, not missing"),
    "cic by 3": (
        stage(0, decimate=3),
        "stage[0].decimate must be a power of two for a CIC filter, whose weights are then exact, not 3",
    ),
    "long cic": (
        stage(0, order=9, decimate=64),
        "stage[0].decimate must be such that order * (decimate - 1) is below 512, as it has so many taps; two stages "
        "in series decimate further, not 64",
    ),
    "same name": (
        stage(1, name="slow"),
        "stage[1].name must be different from the names of the stages before, in small letters too, as files are "
        "named after it, not 'slow'",
    ),
    "same letters": (
        stage(1, name="Slow"),
        "stage[1].name must be different from the names of the stages before, in small letters too, as files are "
        "named after it, not 'Slow'",
    ),
    "long": (
        lambda tree: tree["stage"].extend(
            {"name": f"more{k}", "kind": "cic", "order": 1, "decimate": 64} for k in range(2)
        ),
        "stage[5].decimate must be such that all stages together decimate by at most 4096, as their response is "
        "computed at the first rate, not 64",
    ),
    "realization": (
        hardware(realization="df1"),
        "hardware.realization must be left out with [[stage]], as every stage has its own, not 'df1'",
    ),
    "begins": (
        stage(1, name="slow_down"),
        "stage[1].name must be a name that does not begin with slow_, as parts of the stage slow do, not 'slow_down'",
    ),
    "no name": (
        stage(1, name=None),
        "stage[1].name must be a Verilog identifier of at most 64 letters, digits and underscores, not missing",
    ),
    "family": (
        stage(2, family="kaiser"),
        "stage[2].family must be a family with poles in a stage of the kind iir, not 'kaiser'",
    ),
    "rate": (
        lambda tree: tree["stage"].insert(0, {"name": "third", "kind": "fir", "taps": [1], "decimate": 3}),
        "stage[1] must be at a rate that is a finite decimal in Hz, so that its edges compare exactly, not at "
        "2666.6666666666665 Hz",
    ),
    "edge without a number": (
        stage(1, passband_edge="300 Hz"),
        "stage[1].passband_edge must be a number, not '300 Hz': write 300, without quotes and unit",
    ),
    **{
        f"cutoff {cutoff}": (
            stage(2, cutoff=Decimal(cutoff)),
            f"stage low: filter.cutoff must be {wanted}, not {cutoff}",
        )
        for cutoff, wanted in (
            ("nan", "a finite number"),
            ("1e+999999999", "a number of at most 130 digits, zero or from 1e-30 to below 1e30 in size"),
        )
    },
    "filter": (
        lambda tree: tree.update(filter={"taps": [1.0]}),
        "filter must be left out with [[stage]], which takes name, sample_rate, channels, input, stage, limits, "
        "output, hardware, not a table",
    ),
    "none": (lambda tree: tree.update(stage=[]), "stage must be a list of 1 to 8 tables [[stage]], not 0 of them"),
    "flags": (
        stage(1, name="flags"),
        "stage[1].name must be another name than flags, which a module of the chain has, not 'flags'",
    ),
    "samples": (
        hardware(samples_per_clock=2),
        "not yet available: hardware.samples_per_clock must be 1 with [[stage]], as a stage after one that decimates "
        "gets single samples, not beats of several, not 2",
    ),
}


def test_names_are_kept_in_every_stage() -> None:
    chain = loaded(hardware(keep=True)).checked
    assert all(stage.ordinary(chain, (ANY_INPUT,), ANY_OUTPUT).hardware.keep for stage in chain.stages)


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_chain_does_not_take_is_refused(name: str) -> None:
    change, sentence = REFUSED[name]
    with pytest.raises(SpecificationError) as refused:
        loaded(change)
    assert str(refused.value) == f"specification: {sentence}"


def test_what_a_decimating_stage_does_not_take_is_refused_with_its_name() -> None:
    with pytest.raises(SpecificationError) as refused:
        loaded(lambda tree: (hardware(multipliers=0)(tree), stage(1, decimate=2)(tree)))
    assert str(refused.value) == (
        "specification: stage half: not yet available: hardware.multipliers must be 'auto' with an FIR filter that "
        "decimates, not 0"
    )


def test_stages_that_decimate_are_protected_like_others() -> None:
    tree = copy.deepcopy(TREE)
    tree["hardware"] = {"protect": "detect"}
    tree["stage"][2]["protect"] = "none"
    spec = sosmith.ChainSpecification.load(tree).checked
    stages = [each.ordinary(spec, (ANY_INPUT,), ANY_OUTPUT) for each in spec.stages]
    assert [each.hardware.protect for each in stages] == ["detect", "detect", "none", "detect"]


def test_a_stage_that_breaks_a_rule_of_filters_is_named() -> None:
    with pytest.raises(SpecificationError) as refused:
        loaded(stage(2, cutoff=900.0))
    assert str(refused.value).startswith("specification: stage low: filter.decimate must be ")


def test_a_chain_is_no_specification_of_a_core() -> None:
    with pytest.raises(SpecificationError) as refused:
        sosmith.Specification.load(TREE)
    assert str(refused.value) == (
        "specification: not yet available: stage must be left out here, as only board, build, design, explore, "
        "generate, package, reload, simulate and verify take a chain: `sosmith generate` writes a specification of "
        "each stage beside the chain's files, for what takes a single core, not [a table, a table, a table, a table]"
    )


def test_an_error_that_is_too_small_is_refused() -> None:
    tree = copy.deepcopy(TREE)
    tree["output"] |= {"bits": 32, "max_error": 2.4e-10}
    with pytest.raises(sosmith.ShortfallError, match=r"stage \w+: .*"):
        sosmith.design_chain(tree)


def test_a_clock_that_is_too_slow_is_refused_with_the_stage() -> None:
    tree = copy.deepcopy(TREE)
    tree["hardware"] = {"clock": 9000.0}
    tree["stage"][0]["architecture"] = "folded"
    with pytest.raises(sosmith.ShortfallError) as refused:
        sosmith.design_chain(tree)
    assert str(refused.value) == (
        "specification: stage slow: none of the 3 realizations meets the specification: with fir_symmetric, the folded "
        "architecture takes 13 clocks for 4 samples: at a clock of 9,000 Hz the sample rate must be at most 2,769.23 "
        "Hz, not 8,000 Hz"
    )
