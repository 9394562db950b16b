"""Hardware that is designed with room takes every curve within it, and hardware without does not."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES

from sosmith.gen.calibration.day_room import chebyshev, with_day_room
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.reload.reload import ROOM, OtherSet, check_swap, other_set
from sosmith.gen.specification.specification import CalibrationSpec, load
from sosmith.model.dataflow.graph import Op
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reload.constants import constants, packed, values_of

ORDER = 6
RANGES = ((Fraction(0), Fraction(10)), (Fraction(0), Fraction(128)))

DAY = Polynomial.from_numbers(
    [
        ["1.349", "-0.003786"],
        ["0.3609", "0.0005959"],
        ["0.06145", "5.214e-05"],
        ["0.0003245", "-6.477e-06"],
        ["-0.001839", "-2.519e-06"],
        ["0.0003547", "5.328e-07"],
        ["-1.786e-05", "-2.685e-08"],
    ]
)
"""The curve of a day of a sensor of the bench."""

OTHER_DAY = Polynomial.from_numbers(
    [
        ["0.8409", "-0.003780"],
        ["0.3030", "0.0007070"],
        ["0.1022", "0.0001088"],
        ["-0.03599", "-9.519e-05"],
        ["0.009905", "2.447e-05"],
        ["-0.001009", "-2.499e-06"],
        ["3.451e-05", "8.926e-08"],
    ]
)
"""That of another sensor, which is off by less than 1 mm everywhere."""


def plus(polynomial: Polynomial, orders: tuple[int, int], far: Fraction) -> Polynomial:
    """Add a product of Chebyshev polynomials over the ranges, at most `far`."""
    rows = [list(row) for row in polynomial.coefficients]
    for i, a in enumerate(chebyshev(orders[0])):
        for j, b in enumerate(chebyshev(orders[1])):
            rows[i][j] += far * a * b / RANGES[0][1] ** i / RANGES[1][1] ** j
    return Polynomial(tuple(map(tuple, rows)))


@cache
def hardware(room: Fraction | None) -> CoreDesign:
    """Design a calibration by itself for the day's curve, in parallel."""
    polynomial = DAY if room is None else with_day_room(DAY, RANGES, room)[0]
    spec = load(EXAMPLES / "flange_wear_bench.toml")
    calibration = CalibrationSpec(coefficients=polynomial.coefficients, data=None)
    parallel = replace(spec.hardware, architecture="parallel", realization="auto", reload=True)
    return design_core(replace(spec, calibration=calibration, hardware=parallel), core="calibration")


def loaded(room: Fraction | None, polynomial: Polynomial) -> OtherSet:
    return check_swap(
        hardware(room), None, other_set(hardware(room), polynomial=polynomial, max_error=Fraction(1, 100))
    ).new_set


@pytest.mark.slow
@pytest.mark.parametrize("room", [Fraction(1, 4), Fraction(1)])
def test_hardware_with_room_takes_every_curve_within_it(room: Fraction) -> None:
    """The products of Chebyshev polynomials have the largest coefficients of all that are as small."""
    far = [plus(DAY, (i, j), sign * room) for i in range(ORDER + 1) for j in range(2) for sign in (1, -1)]
    assert len([loaded(room, each) for each in far]) == 4 * (ORDER + 1)
    assert loaded(room, DAY).quantized.bound <= loaded(room, far[-1]).quantized.bound + 1


def test_that_of_another_sensor_fits_with_room_and_is_refused_without() -> None:
    assert loaded(Fraction(1), OTHER_DAY).program is None
    message = rf"^the set must fit the hardware: row_power1\.c\d\d must fit \d+ bits, not -?\d+; {ROOM}$"
    with pytest.raises(ShortfallError, match=message):
        loaded(None, OTHER_DAY)


def test_hardware_that_limits_its_output_takes_a_curve_that_stays_within_its_range() -> None:
    gentle = Polynomial.from_numbers([["1.16", "-0.0036"], ["0.3672", "0.0006618"], ["0.05812"]])
    spec = hardware(None).spec
    curve, _ = with_day_room(gentle, RANGES, Fraction(1))
    calibration = CalibrationSpec(coefficients=curve.coefficients, data=None)
    design = design_core(replace(spec, calibration=calibration), core="calibration")
    swap = check_swap(design, None, other_set(design, polynomial=gentle, max_error=Fraction(1, 100)))
    made = swap.new_set.quantized.datapath
    limited, plain = design.datapath.stages[-1].graph, made.stages[-1].graph
    assert limited.nodes[-1].op is Op.CLAMP
    assert plain.nodes[-1].op is not Op.CLAMP
    ((_, low, high),) = plain.output_ranges
    assert limited.nodes[-1].low <= low < high <= limited.nodes[-1].high
    values = values_of(made, constants(design.datapath))
    assert design.architecture.bank(swap.new_set.quantized.datapath, None) == packed(values, constants(design.datapath))


def test_what_is_far_beyond_the_room_is_refused() -> None:
    with pytest.raises(ShortfallError, match=rf"; {ROOM}$"):
        loaded(Fraction(1, 4), plus(DAY, (ORDER, 1), Fraction(2)))


@pytest.mark.parametrize("low", [0, -2])
def test_the_curve_to_design_with_is_as_far_as_it_says(low: int) -> None:
    ranges = ((Fraction(low), Fraction(10)), RANGES[1])
    polynomial, far = with_day_room(DAY, ranges, Fraction(1))
    V, T = np.linspace(low, 10.0, 401), np.array([[0.0], [64.0], [128.0]])
    assert np.abs(polynomial(V, T) - DAY(V, T)).max() == pytest.approx(float(far), rel=1e-6)
    assert 0.5 < far < 1.0


@pytest.mark.parametrize("order", range(9))
def test_chebyshev_polynomials_swing_between_one_and_minus_one(order: int) -> None:
    x = (1 - np.cos(np.pi * np.arange(order + 1) / max(order, 1))) / 2
    values = np.polynomial.polynomial.polyval(x, chebyshev(order))
    assert np.abs(values) == pytest.approx(np.ones(order + 1), abs=1e-6)
    assert all(a * b < 0 for a, b in pairwise(values))


def test_no_room_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^room must be more than 0, not 0$"):
        with_day_room(DAY, RANGES, Fraction(0))
