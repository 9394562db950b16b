"""The track's course, and random irregularities against the spectrum that they are made from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, signal

from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.track import curved_track, tangent_track
from sosmith.instrument.vehicle.track_irregularity import irregularity, spectra, synthesize

TABLE = built_in().track
WAVES = built_in().irregularities


def test_the_papers_track() -> None:
    track = curved_track(TABLE)
    assert track.length == 10 + 50 + 300 + 50 + 200
    s = np.array([-5.0, 0, 10, 35, 60, 200, 360, 385, 410, 610, 700])
    shape = np.array([0, 0, 0, 0.5, 1, 1, 1, 0.5, 0, 0, 0])
    assert track.curvature_at(s) == pytest.approx(shape / 350, abs=1e-15)
    assert track.cant_at(s) == pytest.approx(0.09 * shape, abs=1e-15)
    assert track.widening_at(s) == pytest.approx(0.01 * shape, abs=1e-15)
    assert track.cant_slope_at(np.array([5.0, 10, 35, 60, 385, 500])) == pytest.approx(
        np.array([0, 0.09, 0.09, 0, -0.09, 0]) / 50, abs=1e-15
    )
    wave = track.irregularity_at(np.array([-1.0, 0, 2.5, 5, 7.5, 10, 11]))
    assert wave == pytest.approx([0, 0, 0.01, 0.02, 0.01, 0, 0], abs=1e-12)


@pytest.mark.slow
def test_heading_and_offset_are_the_integrals_of_the_curvature() -> None:
    track = curved_track(TABLE)
    s = np.linspace(0, track.length, 61_001)
    heading = integrate.cumulative_trapezoid(track.curvature_at(s), s, initial=0)
    offset = integrate.cumulative_simpson(track.heading_at(s), x=s, initial=0)
    assert track.heading_at(s) == pytest.approx(heading, abs=1e-12)
    assert track.offset_at(s) == pytest.approx(offset, abs=1e-9)
    assert track.heading_at(s[-1:])[0] == pytest.approx(350 / 350, rel=1e-12)  # 50/2 + 300 + 50/2 m of it
    before = np.array([-20.0])
    assert (track.heading_at(before)[0], track.offset_at(before)[0]) == pytest.approx((0, 0), abs=1e-12)


def test_a_track_may_do_without_some_of_its_sections() -> None:
    track = curved_track(replace(TABLE, tangent=0.0, curve=0.0, run_out=0.0))
    assert track.length == 100
    assert track.curvature_at(np.array([0.0, 25, 50, 100])) == pytest.approx([0, 0.5 / 350, 1 / 350, 0], abs=1e-15)


def test_tangent_track_is_straight_and_as_long() -> None:
    track = tangent_track(TABLE)
    s = np.linspace(-10, 700, 100)
    assert track.length == curved_track(TABLE).length
    for values in (track.curvature_at(s), track.heading_at(s), track.offset_at(s), track.cant_at(s)):
        assert not values.any()
    assert not track.widening_at(s).any()
    assert track.irregularity_at(np.array([5.0])) == [0.02]


def test_the_density_is_the_formula_within_its_band() -> None:
    alignment, level = spectra(WAVES, "low")
    o = 0.8246
    expected = 2.119e-7 * o**2 / ((o**2 + 0.0206**2) * 2 * o**2)
    assert alignment.density(np.array([o]))[0] == pytest.approx(expected, rel=1e-12)
    edges = np.array([2 * math.pi / 100.1, 2 * math.pi / 99.9, 2 * math.pi / 0.501, 2 * math.pi / 0.499])
    assert (level.density(edges) > 0).tolist() == [False, True, True, False]
    _, bad = spectra(WAVES, "high")
    assert bad.density(np.array([1.0])) / level.density(np.array([1.0])) == pytest.approx(1.080e-6 / 4.032e-7)


@pytest.mark.slow
def test_the_spectrum_of_a_profile_is_the_density() -> None:
    """Estimated by Welch's method, which shares nothing with the synthesis, in bands of a third of an octave."""
    spectrum, _ = spectra(WAVES, "low")
    profile = synthesize(spectrum, 40_000.0, np.random.default_rng(3))
    step = profile.distance[1]
    frequency, density = signal.welch(profile.height[:-1], 1 / step, nperseg=2**15, detrend=False)
    wavenumber, density = 2 * math.pi * frequency, density / (2 * math.pi)
    for low in 2 * math.pi / np.geomspace(60, 0.7, 20):
        inside = (wavenumber >= low) & (wavenumber < low * 2 ** (1 / 3))
        assert inside.any()
        ratio = density[inside].mean() / spectrum.density(wavenumber[inside]).mean()
        assert ratio == pytest.approx(1, abs=0.15), f"at {low:g} rad/m"
    (power, _) = integrate.quad(lambda o: spectrum.density(np.array([o]))[0], *spectrum.band, limit=200)
    # the sum over harmonics may hold up to one more or less than the integral at the steep end of the band
    end = 2 * math.pi / profile.distance[-1] * spectrum.density(np.array(spectrum.band[:1]))[0]
    assert end < 0.005 * power
    assert np.var(profile.height[:-1]) == pytest.approx(power, abs=end)


@pytest.mark.slow
def test_height_between_the_points_is_that_of_the_waves() -> None:
    """The spline against the same waves on a grid five times as fine; slopes against differences."""
    spectrum, _ = spectra(WAVES, "high")
    profile = synthesize(spectrum, 300.0, np.random.default_rng(5))
    fine = np.fft.rfft(profile.height[:-1])
    count = len(profile.height) - 1
    exact = np.fft.irfft(np.concatenate([fine, np.zeros(2 * count)]), 5 * count) * 5
    s = profile.distance[-1] / (5 * count) * np.arange(5 * count)
    assert profile.at(s) == pytest.approx(exact, abs=1e-8)
    assert profile.slope_at(s[1:-1]) == pytest.approx((exact[2:] - exact[:-2]) / (s[2] - s[0]), abs=2e-5)
    assert profile.at(s[:5] + profile.distance[-1]) == pytest.approx(profile.at(s[:5]), abs=1e-12)


def test_the_seed_decides_and_both_profiles_differ() -> None:
    first, again = irregularity(WAVES, "low", 500.0, 7), irregularity(WAVES, "low", 500.0, 7)
    other = irregularity(WAVES, "low", 500.0, 8)
    assert (first.alignment.height == again.alignment.height).all()
    assert (first.level.height == again.level.height).all()
    assert not np.allclose(first.alignment.height, other.alignment.height)
    assert abs(np.corrcoef(first.alignment.height, first.level.height)[0, 1]) < 0.6
    assert first.alignment.distance[-1] >= 500
