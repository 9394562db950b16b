"""The vehicle's figures beside the paper's, and the spectrum they come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sosmith.instrument.paper.comparison import Comparison
from sosmith.instrument.paper.figures import read_paper_figures
from sosmith.instrument.paper.vehicle_comparison import comparison, run_comparison
from sosmith.instrument.vehicle.amplitude_spectrum import amplitude_spectrum, attenuation, ripple
from sosmith.instrument.vehicle.motion import Motion
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.vehicle_report import vehicle_csv, vehicle_run


@pytest.fixture(scope="module")
def motion() -> Motion:
    settings = {"sample_rate": 100.0, "irregularities": "none", "seed": 1, "model": "linear"}
    return vehicle_run(built_in(), track="paper", speed=20.0, **settings).motion


@pytest.mark.slow
def test_zero_is_written_without_a_sign(motion: Motion) -> None:
    values = {name: getattr(motion, name)[:1] for name in motion.__dataclass_fields__}
    text = vehicle_csv(Motion(**values | {"body_lateral": np.array([-1e-12]), "body_yaw": np.array([-2e-6])}))
    header, row = (line.split(",") for line in text.splitlines())
    assert row[header.index("body_lateral_mm")] == "0.000000"
    assert row[header.index("body_yaw_mrad")] == "-0.002000"


def rows_of(motion: Motion) -> dict[str, Comparison]:
    every = [one for rows in comparison(motion, read_paper_figures()).values() for one in rows]
    by_name = {one.quantity: one for one in every}
    assert len(by_name) == len(every)
    return by_name


def ours_of(motion: Motion) -> dict[str, float]:
    return {name: float(one.ours) for name, one in rows_of(motion).items() if one.ours is not None}


@pytest.mark.slow
def test_every_figure_of_the_tables_is_there_once(motion: Motion) -> None:
    tables = comparison(motion, read_paper_figures())
    assert {number: len(rows) for number, rows in tables.items()} == {5: 7, 6: 6, 7: 6, 8: 22}
    assert all(one.note for one in rows_of(motion).values())


def test_figures_stand_beside_their_own(motion: Motion) -> None:
    printed = {name: str(one.printed) for name, one in rows_of(motion).items()}
    assert printed["vertical, wheelset 1, left wheel"] == "0.2"
    assert printed["lateral, wheelset 3 to the right"] == "5.92"
    assert printed["yaw, wheelset 2 to bogie 2"] == "0.0037137"
    assert printed["lateral at 50 Hz, wheelset 5"] == "20.94"
    assert printed["vertical at 50 Hz, bogie 2"] == "23.769"


def test_figures_are_those_of_the_motion(motion: Motion) -> None:
    ours = ours_of(motion)
    lateral = motion.wheelset_lateral
    assert ours["lateral, wheelset 2 to the right"] == pytest.approx(-1e3 * lateral[:, 1].min())
    assert ours["lateral, wheelset 3 to the left"] == pytest.approx(1e3 * lateral[:, 2].max())
    assert ours["vertical, wheelset 1, right wheel"] == pytest.approx(150 * -motion.lateral_to_rails[:, 0].min())
    assert ours["vertical, bogie"] == pytest.approx(1e3 * motion.frame_vertical.max())
    yaw = motion.wheelset_yaw_to_frame
    assert ours["yaw, wheelset 1 to bogie 2"] == pytest.approx(np.abs(yaw[:, 3]).max())
    _, amplitude = amplitude_spectrum(1e3 * motion.frame_lateral[:3050, 1], 100.0)
    shorter = Motion(**{name: getattr(motion, name)[:3050] for name in motion.__dataclass_fields__})
    again = ours_of(shorter)
    assert max(again.values()) == ours["vertical at 50 Hz, wheelset 1"] == 180  # no more than rounding
    assert again["lateral at 50 Hz, bogie 2"] == pytest.approx(attenuation(amplitude[-1]), abs=1e-6)


def test_the_printed_attenuations_are_those_of_the_printed_ripples() -> None:
    """Section 5.3 names ripples of the bogie and of the yaw; -20 log10 of them gives table 8."""
    vertical, lateral, yaw = (
        [float(value) for value in read_paper_figures().numbers("table_8", name)]
        for name in ("vertical", "lateral", "yaw")
    )
    assert attenuation(0.0648) == pytest.approx(vertical[6], abs=5e-3)
    assert attenuation(0.0165) == pytest.approx(lateral[6], abs=5e-3)
    assert attenuation(0.1) == yaw[0] == 20
    assert attenuation(0.0668) == pytest.approx(yaw[5], abs=5e-3)
    assert attenuation(0.0) == float("inf")


@pytest.mark.parametrize("count", [1000, 1001])
def test_an_amplitude_is_that_of_a_sine_wave(count: int) -> None:
    rate = 100.0
    clock = np.arange(count) / rate
    wave = 20 * rate / count  # a whole number of periods
    frequency, amplitude = amplitude_spectrum(0.5 + 3 * np.sin(2 * np.pi * wave * clock), rate)
    assert frequency[20] == pytest.approx(wave)
    assert amplitude[20] == pytest.approx(3)
    assert amplitude[0] == pytest.approx(0.5)
    assert np.delete(amplitude, [0, 20]).max() < 1e-9
    assert ripple(3 * np.sin(2 * np.pi * wave * clock), rate, wave) == pytest.approx(3)


def test_an_amplitude_at_half_the_sample_rate_counts_once() -> None:
    values = 2.0 * (-1.0) ** np.arange(100)
    frequency, amplitude = amplitude_spectrum(values, 100.0)
    assert frequency[-1] == 50
    assert amplitude[-1] == pytest.approx(2)
    assert ripple(values, 100.0, 50.0) == pytest.approx(2)


@pytest.mark.slow
def test_only_the_papers_track_speed_and_rate_are_compared() -> None:
    given = built_in()
    short = replace(given, track=replace(given.track, curve=10.0, run_out=0.0))
    usual = {
        "track": "paper",
        "speed": 20.0,
        "sample_rate": 100.0,
        "irregularities": "none",
        "seed": 1,
        "model": "linear",
    }
    figures = read_paper_figures()
    assert list(run_comparison(vehicle_run(short, **usual), figures)) == [5, 6, 7, 8]
    for change in ({"track": "tangent"}, {"speed": 25.0}, {"sample_rate": 99.0}):
        assert run_comparison(vehicle_run(short, **usual | change), figures) == {}
