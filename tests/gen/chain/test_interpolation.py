"""Chains with stages that interpolate: results, flags, gains and images, against their definitions."""

from __future__ import annotations

import shutil
import subprocess
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.signal import upfirdn
from tests.gen.chain.rising import SHAPES, UP, draw, exact, filtered, flags, stimulus

import sosmith
from sosmith.gen.chain import response
from sosmith.gen.chain.c_model import chain_source
from sosmith.gen.chain.ideal import ideal_chain
from sosmith.gen.chain.rates import Rate, gathered, results_of
from sosmith.gen.chain.response import Part, peak_gain, segments_of
from sosmith.gen.specification.exact_values import exact as exact_values
from sosmith.gen.specification.toml_text import toml_text
from sosmith.model.errors import SpecificationError
from sosmith.verify.certificate_file import SectionEntry
from sosmith.verify.chain.responses import Part as ProvenPart
from sosmith.verify.chain.responses import peak_gain as proven_gain

FEW = (0, 3)
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in range(2 * len(SHAPES))]
_SLACK = Fraction(1, 10**60)
MAIN = """
#include "rx.h"
#include <stdio.h>

int main(void)
{
    rx_state state;
    long long x;
    int64_t y[RX_RESULTS];
    uint8_t status[RX_RESULTS];
    int count, k;
    rx_reset(&state);
    while (scanf("%lld", &x) == 1) {
        count = rx_push(&state, x, y, status);
        for (k = 0; k < count; k++)
            printf("%lld %d\\n", (long long)y[k], status[k]);
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def up() -> sosmith.Chain:
    return sosmith.design_chain(UP | {"hardware": {"start": "zero"}})


@pytest.mark.sweep(1)
@pytest.mark.parametrize("seed", CASES)
def test_results_are_those_of_the_definition(seed: int) -> None:
    chain = sosmith.design_chain(draw(seed))
    codes = stimulus(chain, 90, seed)
    (port,), out = chain.core.spec.base.inputs, chain.core.stages[-1].output
    results, status = chain.core.compute_with_status(codes[:, :, None])
    golden = chain.run_exact(x=port.decode(codes))
    low, high = out.lsb * out.lowest, out.lsb * out.highest
    for k in range(codes.shape[1]):
        wanted = [min(max(y, low), high) for y in exact(chain, [port.zero + port.lsb * int(v) for v in codes[:, k]])]
        errors = [abs(out.lsb * int(y) - e) for y, e in zip(results[:, k], wanted, strict=True)]
        assert max(errors) <= chain.core.bound + _SLACK
        assert np.array_equal(status[:, k] & 1, flags(chain, codes[:, k]))
        assert np.allclose(golden[:, k], [float(y) for y in wanted], atol=1e-9)
    check_sines(chain)


def check_sines(chain: sosmith.Chain) -> None:
    """Search for a sine that has a stronger image, or alias, than is claimed, by the parts' own taps."""
    for each in chain.core.foldings:
        segment, least = each.segment, max(each.segment.rise, each.segment.factor)
        frequencies = np.linspace(0.5 / least, 0.5, 4001)
        gains = np.ones(frequencies.shape) / segment.rise
        for part, spread in zip(segment.parts, segment.spreads, strict=True):
            z = np.exp(-2j * np.pi * frequencies * spread)
            for b, a in part.sections:
                over, under = (sum(float(c) * z**k for k, c in enumerate(taps)) for taps in (b, a))
                gains = gains * np.abs(over / under)
        claimed = float(each.anywhere.gain)
        assert 0.97 * claimed <= gains.max() <= claimed * (1 + 1e-9)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("factor", [2, 5])
def test_a_sine_has_the_images_that_are_claimed(factor: int) -> None:
    """The spectrum of what comes out, measured: no line but that of the sine is above the claim."""
    taps = np.hanning(4 * factor + 1)[1:-1] * 1.0
    stage = {"name": "fill", "kind": "fir", "interpolate": factor, "taps": taps.tolist()}
    tree = UP | {"stage": [stage], "output": {"bits": 24, "range": [-8.0, 8.0], "signed": True}}
    chain = sosmith.design_chain(tree | {"input": {"x": {"bits": 20, "range": [-1.0, 1.0], "signed": True}}})
    claimed, at = chain.images["anywhere"]
    count, largest = 400, 0.0
    for cycles in range(3, count // 2, 8):
        sine = np.sin(2 * np.pi * cycles * np.arange(4 * count) / count)
        lines = np.abs(np.fft.rfft(chain.run(x=sine)[-count * factor :])) * 2 / (count * factor)
        lines[cycles] = 0
        largest = max(largest, lines.max())
        assert lines.max() <= claimed * (1 + 1e-4)
    assert largest > 0.9 * claimed
    assert 4000 <= at <= 4000 * factor


def test_results_are_those_of_upfirdn() -> None:
    taps = [0.25, 0.5, 1.0, 0.75, 0.25]
    stage = {"name": "fill", "kind": "fir", "interpolate": 2, "taps": taps}
    chain = sosmith.design_chain(UP | {"stage": [stage], "hardware": {"start": "zero"}})
    x = np.random.default_rng(1).integers(-128, 128, 200) / 128
    assert chain.rise == 2
    assert np.abs(chain.run(x=x) - upfirdn(taps, x, up=2)[:400]).max() <= chain.bound


@pytest.mark.slow
def test_the_gain_in_the_pass_band_is_that_of_the_filter(up: sosmith.Chain) -> None:
    """Taps of a half-band filter are times L, so that a constant passes as it is."""
    stage = {"name": "half", "kind": "halfband", "passband_edge": 2000.0, "passband_loss": 0.1, "stopband_loss": 40.0}
    chain = sosmith.design_chain(UP | {"stage": [stage | {"interpolate": 2}]})
    assert abs(chain.frequency_response([0.0])[0]) == pytest.approx(1, abs=0.02)
    assert chain.run(x=np.full(60, 0.5))[-1] == pytest.approx(0.5, abs=0.02)
    given = abs(up.frequency_response([0.0])[0])
    assert given == pytest.approx(2.75 / 2, rel=1e-9)


@pytest.mark.slow
def test_the_c_model_computes_what_the_design_does(up: sosmith.Chain, tmp_path: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("a C compiler is missing")
    up.generate(tmp_path)
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    sources = [f"{name}.c" for name in ("main", "rx", *(stage.name for stage in up.stages))]
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-o", "main"]
    subprocess.run([compiler, *options, *sources], cwd=tmp_path, check=True)
    codes = stimulus(up, 200, 1)
    given = "\n".join(map(str, codes[:, 0].tolist()))
    printed = subprocess.run([tmp_path / "main"], input=given, capture_output=True, text=True, check=True).stdout
    results = np.array([list(map(int, line.split())) for line in printed.splitlines()])
    expected, status = up.core.compute_with_status(codes[:, :, None])
    assert np.array_equal(results[:, 0], expected[:, 0])
    assert np.array_equal(results[:, 1], status[:, 0])
    assert (status[: up.core.settling, 0] >> 5 & 1).all()
    assert up.core.settling % 8 == 0


def test_a_narrow_filter_behind_one_that_decimates_is_soon_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slopes of its sections cancel each other; product by product, tens of thousands of intervals were looked at."""
    stages = [
        {"name": "half", "kind": "fir", "taps": [-0.7, -1.5], "decimate": 2},
        {"name": "low", "kind": "iir", "family": "chebyshev1", "order": 5, "cutoff": 16.0, "passband_loss": 0.5},
    ]
    chain = ideal_chain(sosmith.ChainSpecification.load(UP | {"stage": stages}).checked)
    (segment,) = segments_of([part for stage in chain.stages for part in stage.parts])
    looked = []
    monkeypatch.setattr(response.Tangents, "on", lambda *args, on=response.Tangents.on: looked.append(0) or on(*args))
    peak = response.gain_into_passband(segment, Fraction(16, 8000))
    assert 0.8 <= peak.gain <= 0.801
    assert len(looked) < 500


def test_no_variable_of_the_c_model_has_the_name_of_a_parameter() -> None:
    stage = {"name": "at_x_code", "kind": "fir", "interpolate": 2, "taps": [1.0, 0.5]}
    text = chain_source(sosmith.design_chain(UP | {"stage": [stage], "input": {"count_at_x": UP["input"]["x"]}}).core)
    assert "int64_t count_at_x_code, int64_t *result" in text
    assert "int at_x_code_count = 0, total" in text


@pytest.mark.slow
def test_what_is_shown_of_a_chain_that_interpolates(up: sosmith.Chain, tmp_path: Path) -> None:
    tables = {table.title: table for table in up.tables()}
    assert "Images: largest end-to-end gain, proven" in tables
    assert str(tables["rx: stages"].rows[0][1]) == "fir at 8 kHz, interpolates by 2"
    assert up.folding == {}
    assert set(up.images) == {"anywhere", "passband"}
    assert [stage.name for stage in up.stages][:3] == ["rx_fill_p0", "rx_fill_p1", "rx_low"]
    assert b"proven image limit" in up.plot(tmp_path / "up.svg").read_bytes()
    down = {"name": "down", "kind": "cic", "order": 2, "decimate": 4}
    both = sosmith.design_chain(UP | {"stage": [down, UP["stage"][2]]})
    assert (set(both.folding), set(both.images)) == ({"anywhere"}, {"anywhere"})
    titles = [table.title for table in both.tables()]
    assert "Aliasing: largest gain from 8 kHz to 2 kHz, proven" in titles
    assert "Images: largest gain from 2 kHz to 8 kHz, proven" in titles


@pytest.mark.parametrize(
    ("rise", "factor", "phases"), [(1, 1, 1), (3, 1, 3), (4, 2, 2), (3, 2, 3), (2, 4, 1), (6, 4, 3)]
)
@pytest.mark.parametrize("pole", [Fraction(0), Fraction(-7, 8)])
def test_a_gain_is_the_largest_of_the_phases_that_leave(rise: int, factor: int, phases: int, pole: Fraction) -> None:
    """By the response in doubles: of every phase p of rise results, those that are left are multiples of a gcd."""
    taps = tuple(Fraction(k * k % 7 - 3, 8) for k in range(17))
    parts = [Part(((taps, (Fraction(1),)),), rise=rise), Part((((Fraction(1),), (Fraction(1), pole)),), factor)]
    (segment,) = segments_of(parts)
    assert (segment.rise, segment.factor) == (rise, factor)
    response = [float(tap) for tap in taps] + [0.0] * 400
    for n in range(1, len(response)):
        response[n] -= float(pole) * response[n - 1]
    sums = [np.abs(response[p::rise]).sum() for p in range(0, rise, rise // phases)]
    assert float(peak_gain(parts, steady=False)) == pytest.approx(max(sums), rel=1e-9)


def test_poles_at_rates_far_apart_are_a_few_of_the_lowest_rate() -> None:
    """Without that, the response at the highest rate has the poles of a polynomial of a degree of hundreds."""
    slow = (((Fraction(1, 16),), (Fraction(1), Fraction(-3, 2), Fraction(5, 8))),)
    parts = [Part(slow), Part((((Fraction(1, 4),) * 3, (Fraction(1),)),), 32), Part(slow)]
    gain = peak_gain(parts, steady=True)
    assert gain == pytest.approx(proven_gain(list(map(entry_of, parts)), steady=True), rel=1e-15)


def started(parts: list[Part], values: list[Fraction]) -> list[Fraction]:
    """Results of parts that each start as if its first sample had been there for ever."""
    for part in parts:
        (taps, under), *_ = part.sections
        if part.rise == 1:
            values = filtered(taps, under, values, steady=True)[:: part.factor]
            continue
        past = [*values[:1] * len(taps), *values]
        last = len(taps) + np.arange(len(values))
        values = [
            sum((tap * past[m - n] for n, tap in enumerate(taps[phase :: part.rise])), Fraction(0))
            for m in last
            for phase in range(part.rise)
        ]
    return values


LOPSIDED = tuple(Fraction(tap, 4) for tap in (7, 0, 1, 1))


@pytest.mark.parametrize(
    "behind", [Part(((((Fraction(1, 2),) * 2), (Fraction(1),)),)), Part(((LOPSIDED, (Fraction(1),)),), rise=2)]
)
@pytest.mark.parametrize("last", [Fraction(0), Fraction(-1, 2)])
def test_what_a_start_makes_of_an_error_is_in_the_gain(behind: Part, last: Fraction) -> None:
    """Behind a stage whose results of a constant differ, the first result alone is taken for all before it."""
    parts = [Part(((LOPSIDED, (Fraction(1),)),), rise=2), behind, Part((((Fraction(1),), (Fraction(1), last)),), 2)]
    count = 24
    columns = [started(parts, [Fraction(n == m) for n in range(count)]) for m in range(count)]
    largest = max(sum(map(abs, row)) for row in zip(*columns, strict=True))
    gain, proven = peak_gain(parts, steady=True), proven_gain(list(map(entry_of, parts)), steady=True)
    assert peak_gain(parts, steady=False) < largest <= gain
    assert abs(proven - gain) < Fraction(1, 1 << 64)


def entry_of(part: Part) -> ProvenPart:
    entries = tuple(SectionEntry(numerator=taps, denominator=under) for taps, under in part.sections)
    return ProvenPart(entries, part.factor, part.rise)


def test_flags_of_samples_between() -> None:
    told = np.array([1, 0, 2, 0, 4, 0, 8], dtype=np.uint8)
    assert gathered(told, [Rate(2, 1), Rate(1, 3)]).tolist() == [1, 0, 2, 4, 8]
    assert gathered(told[:0], [Rate(2, 1)]).tolist() == []
    assert results_of([Rate(2, 1), Rate(1, 3)], 7) == 5


REFUSED: dict[str, tuple[list[dict[str, Any]], str]] = {
    "two turns": (
        [
            {"name": "a", "kind": "gain", "factor": 0.5},
            {"name": "b", "kind": "cic", "order": 1, "interpolate": 2},
            {"name": "c", "kind": "cic", "order": 1, "decimate": 2},
            {"name": "d", "kind": "cic", "order": 1, "interpolate": 2},
        ],
        "specification: not yet available: stage[3].interpolate must be left out where the rate has turned behind the "
        "first stage once already, as flags follow one turn, not 2",
    ),
    "a result of nothing": (
        [{"name": "a", "kind": "fir", "taps": [1.0, 0.0, 0.5], "interpolate": 2}],
        "specification: stage a: taps 1, 3, .. must not all be 0, as one result in 2 would be",
    ),
    "too much in all": (
        [{"name": f"s{k}", "kind": "fir", "taps": [1.0] * 32, "interpolate": 32} for k in range(3)],
        "specification: stage[2].interpolate must be such that all stages together interpolate by at most 4096, as "
        "their response is computed at the last rate, not 32",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_chain_does_not_take_is_refused(name: str) -> None:
    stages, message = REFUSED[name]
    with pytest.raises(SpecificationError) as refused:
        sosmith.design_chain(UP | {"stage": stages})
    assert str(refused.value) == message


def from_file(folder: Path, name: str, taps: list[float]) -> Path:
    """Write a specification of a stage that interpolates by 2, and its taps in a file."""
    match name.rpartition(".")[2]:
        case "npy":
            np.save(folder / name, np.array(taps))
        case "mat":
            savemat(folder / name, {"b": np.array([taps]), "a": np.array([[3.0]])})
        case _:
            (folder / name).write_text("\n".join(map(str, taps)), encoding="utf-8")
    stage = {"name": "fill", "kind": "fir", "interpolate": 2, "taps_file": name}
    path = folder / "rx.toml"
    path.write_text(toml_text(exact_values(UP | {"stage": [stage]})), encoding="utf-8")
    return path


TAPS = [0.1, 0.3, 3e-29, 0.7, 0.2, 0.25, 0.0]


@pytest.mark.parametrize("name", ["taps.npy", "taps.csv"])
def test_taps_of_a_file_are_used_as_they_are(name: str, tmp_path: Path) -> None:
    """Doubles digit by digit; the zero at the end stays."""
    chain = sosmith.design_chain(from_file(tmp_path, name, TAPS))
    told = [Fraction(tap) if name.endswith("npy") else Fraction(Decimal(str(tap))) for tap in TAPS]
    for k, core in enumerate(chain.core.stages[0].cores):
        assert list(core.spec.filter.taps or ()) == told[k::2]
    x = np.array([0.5, 0.0, 0.0, 0.0, -1.0])
    chain_of_zeros = np.concatenate([np.full(4, x[0]), x])  # the first value was there before
    assert np.abs(chain.run(x=x) - upfirdn(TAPS, chain_of_zeros, up=2)[8:18]).max() <= chain.bound


def test_taps_that_never_end_are_refused(tmp_path: Path) -> None:
    path = from_file(tmp_path, "taps.mat", [1.0, 2.0, 1.0])
    with pytest.raises(SpecificationError) as refused:
        sosmith.design_chain(path)
    assert str(refused.value) == (
        f"{path}: stage fill: taps must be finite decimals, as those of each phase are written out, not "
        "0.3333333333333333"
    )
