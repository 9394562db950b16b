"""A reading that stands still: its mean, how well it is known, and what is waited for or refused."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from tests.host.lines import plain_device
from tests.interface.instrument.live.gauging import GAUGE, GaugingDevice, Time

import sosmith
from sosmith.host.board import Board
from sosmith.host.model_line import ModelLine
from sosmith.interface.instrument.live.steady import SteadyReader, mean_of
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import EQUATION_5A


@cache
def design(channels: int = 1) -> sosmith.Design:
    return sosmith.design(GAUGE | {"channels": channels})


def reader(
    voltages: Callable[[float], object], clock: Time, channels: int = 1, channel: int = 0
) -> tuple[SteadyReader, GaugingDevice]:
    device = GaugingDevice(design(channels), clock.monotonic, voltages)
    return SteadyReader(Board.on(ModelLine(device)), channel, clock), device


def clearance(voltage: float) -> float:
    return float(EQUATION_5A(np.array(voltage), np.array(21.0)))


@pytest.mark.sweep(1)
@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_the_mean_of_correlated_results_is_known_as_well_as_it_says(memory: float) -> None:
    rng = np.random.default_rng(int(10 * memory))
    held = []
    for _ in range(400):
        noise = rng.normal(0, 1, 1200)
        for n in range(1, len(noise)):
            noise[n] += memory * noise[n - 1]
        found = mean_of(noise[200:])
        held.append(abs(found.value) <= 1.96 * found.uncertainty)
        assert found.count == 1000
        assert found.scatter == pytest.approx(1 / math.sqrt(1 - memory**2), rel=0.3)
    assert 0.9 < np.mean(held) < 0.98


def test_the_mean_of_equal_results_is_known_exactly() -> None:
    found = mean_of(np.full(20, 3.25))
    assert (found.value, found.scatter, found.uncertainty, found.count) == (3.25, 0.0, 0.0, 20)


@pytest.mark.slow
def test_what_was_kept_before_does_not_count_and_a_filter_settles() -> None:
    clock, rng = Time(), np.random.default_rng(1)
    steady, _ = reader(lambda t: (2.0 if t < 10 else 5.0) + rng.normal(0, 0.01), clock)
    clock.now = 10.0
    found = steady.read(1.0, 0.002)
    assert found.count == 1000
    assert abs(found.value - clearance(5.0)) < 4 * found.uncertainty + 0.0005
    assert 0.0001 < found.uncertainty < found.scatter < 0.005


def test_results_of_the_target_before_do_not_count() -> None:
    """The board has kept 255 of them, which stand still as well."""
    steady, _ = reader(lambda t: 2.0 if t < 1 else 5.0, clock := Time())
    clock.now = 1.0
    assert steady.read(0.1, 0.002).value == pytest.approx(clearance(5.0), abs=0.002)


def test_a_board_that_measures_faster_than_it_is_read_is_read() -> None:
    """Whenever it is asked, there are new results."""

    class Passing(Time):
        def monotonic(self) -> float:
            self.now += 0.03
            return self.now

    asked = 0

    def voltage(t: float) -> float:
        nonlocal asked
        asked += 1
        assert asked < 5000
        return 5.0

    steady, _ = reader(voltage, Passing())
    assert steady.read(0.1, 0.002).value == pytest.approx(clearance(5.0), abs=0.002)


def test_noise_is_no_motion() -> None:
    clock, rng = Time(), np.random.default_rng(1)
    steady, _ = reader(lambda t: 5.0 + rng.normal(0, 0.1), clock)
    for _ in range(5):
        begin = clock.now
        assert steady.read(0.5, 0.0).value == pytest.approx(clearance(5.0), abs=0.03)
        assert clock.now - begin < 2.0


@pytest.mark.slow
def test_each_channel_is_read_by_itself_though_results_were_overwritten() -> None:
    for channel, voltage in enumerate((2.0, 5.0, 8.0)):
        clock = Time()
        steady, _ = reader(lambda t: np.array([2.0, 5.0, 8.0]), clock, 3, channel)
        clock.now = 7.0
        assert steady.read(0.5, 0.002).value == pytest.approx(clearance(voltage), abs=0.002)


@pytest.mark.slow
def test_a_reading_that_moves_is_refused() -> None:
    steady, _ = reader(lambda t: 2 + 0.05 * t, Time())
    message = r"^the result must stand still for 1 s, not be moving by 0\.0\d+ mm after 40 tries$"
    with pytest.raises(ShortfallError, match=message):
        steady.read(1.0, 0.002)


def test_a_reading_with_a_flag_is_refused_and_waited_for() -> None:
    clock = Time()
    steady, device = reader(lambda t: 5.0, clock)
    device.raised = 1 << Flag.FAULT
    with pytest.raises(
        ShortfallError, match=r"^the result must stand still for 0\.1 s, not be with the flag fault aft"
    ):
        steady.read(0.1, 0.002)
    steady, _ = reader(lambda t: 0.0 if t < 2 else 5.0, clock := Time())
    assert steady.read(0.2, 0.002).value == pytest.approx(clearance(5.0), abs=0.002)
    assert clock.now > 2.2


def test_only_a_board_that_measures_is_read() -> None:
    with pytest.raises(
        SpecificationError, match=r"^the board must measure by itself, with converters, not be fed over"
    ):
        SteadyReader(Board.on(ModelLine(plain_device())))
    with pytest.raises(SpecificationError, match=r"^the channel must be 0 to 2, not 3$"):
        reader(lambda t: 5.0, Time(), 3, 3)
