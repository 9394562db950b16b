"""The decimator: equal to a moving sum in exact integers, from the first sample on, in the model and in C."""

import ctypes
import doctest
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.model.dataflow.decimators import decimated
from tests.model.datapaths import INPUT

from sosmith.model.dataflow import decimator as decimator_module
from sosmith.model.dataflow.c_model import c_header, c_source
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.status import Flag
from sosmith.model.port import Port


def port(bits: int, *, signed: bool) -> Port:
    return Port(name="x", bits=bits, signed=signed, lsb=Fraction(1, 8), zero=Fraction(0), unit="V")


def decimator(factor: int = 4, stages: int = 3, dropped: int = 0, *, bits: int = 8, signed: bool = True) -> Decimator:
    return Decimator(input=port(bits, signed=signed), factor=factor, stages=stages, dropped=dropped)


def convolved(made: Decimator, codes: list[int]) -> list[int]:
    """Compute results as sums of products, with the first sample for all that come before it."""
    taps = made.impulse_response
    return [
        sum(tap * codes[max(last - k, 0)] for k, tap in enumerate(taps)) for last in range(0, len(codes), made.factor)
    ]


def test_the_worked_example_is_true() -> None:
    results = doctest.testmod(decimator_module)
    assert results.attempted > 0
    assert results.failed == 0


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize(("factor", "stages"), [(2, 1), (2, 5), (4, 3), (16, 4), (64, 2)])
def test_results_are_moving_sums(factor: int, stages: int, signed: bool) -> None:
    made = decimator(factor, stages, signed=signed)
    rng = np.random.default_rng(factor)
    codes = rng.integers(made.input.lowest, made.input.highest + 1, 500)
    codes[200:300] = made.input.highest
    codes[300:400] = made.input.lowest
    assert made.exact(codes).tolist() == convolved(made, codes.tolist())


@pytest.mark.parametrize(("factor", "stages", "remembered"), [(2, 1, 1), (2, 5, 3), (4, 3, 3), (4, 4, 3), (16, 4, 4)])
def test_from_zero_all_samples_before_count_as_zero(factor: int, stages: int, remembered: int) -> None:
    made = replace(decimator(factor, stages), steady=False)
    codes = np.random.default_rng(factor).integers(-128, 128, 500)
    codes[0] = 127  # a sample that shows
    taps, padded = made.impulse_response, [0] * stages * factor + codes.tolist()
    wanted = np.convolve(padded, taps)[stages * factor : len(padded) : factor]
    assert made.exact(codes).tolist() == wanted.tolist()
    # Results that remember other samples before are as many as stated.
    steady = replace(made, steady=True).exact(codes)
    assert (steady != made.exact(codes)).nonzero()[0].tolist() == [*range(remembered)]


@pytest.mark.parametrize("dropped", [0, 1, 5, 6])
def test_one_rounding_to_nearest_follows(dropped: int) -> None:
    made = decimator(dropped=dropped)
    codes = np.random.default_rng(1).integers(-128, 128, 400)
    exact, rounded = made.exact(codes), made.compute(codes)
    errors = {rounded_ - Fraction(exact_, 2**dropped) for exact_, rounded_ in zip(exact, rounded, strict=True)}
    assert -Fraction(1, 2) < min(errors)
    assert max(errors) <= Fraction(1, 2)
    assert rounded.min() >= made.output.lowest
    assert rounded.max() <= made.output.highest
    assert max(errors) * made.lsb <= made.rounding


def within(value: int, bits: int, *, signed: bool) -> int:
    """Value of the lowest `bits` bits."""
    value %= 1 << bits
    return value - (1 << bits) if signed and value >> (bits - 1) else value


@pytest.mark.parametrize("signed", [True, False])
def test_the_registers_are_as_wide_as_they_must_be(signed: bool) -> None:
    """Computed modulo 2**width, every result is right; with a bit less, some are not."""
    made = decimator(16, 4, signed=signed)
    codes = np.repeat([made.input.lowest, made.input.highest], 400)
    exact = convolved(made, codes.tolist())
    assert [within(value, made.width, signed=signed) for value in exact] == exact
    assert [within(value, made.width - 1, signed=signed) for value in exact] != exact


def test_a_result_tells_of_the_rails_of_all_its_samples() -> None:
    made = decimator(4, 1)
    codes = np.zeros(21, dtype=np.int64)
    for number, code in ((0, -128), (4, 127), (5, 127), (12, -128), (13, 126)):
        codes[number] = code
    assert made.at_rail(codes).tolist() == [True, True, True, True, False, False]
    assert [made.at_rail(codes[:count]).tolist() for count in (0, 1, 5)] == [[], [True], [True, True]]


def test_the_response_at_the_higher_rate() -> None:
    made = decimator(4, 2)
    response = made.before(np.array([1.0, 0.0, -0.5]))
    expected = np.convolve([1, 2, 3, 4, 3, 2, 1], [1, 0, 0, 0, 0, 0, 0, 0, -0.5]) / 16
    assert np.allclose(response[: len(expected)], expected, rtol=0, atol=1e-15)
    assert not response[len(expected) :].any()


def test_a_datapath_behind_a_decimator() -> None:
    datapath = decimated()
    assert datapath.decimator is not None
    codes = np.random.default_rng(2).integers(-32768, 32768, (1001, 1))
    entering = datapath.decimator.compute(codes[:, 0])[:, np.newaxis]
    alone = datapath.behind_decimator
    assert datapath.results(1001) == len(entering) == 126
    assert datapath.compute(codes).tolist() == alone.compute(entering).tolist() == datapath.compute_exact(codes)
    status = datapath.compute_status(codes)
    codes[3] = 32767
    rail = datapath.compute_status(codes) ^ status
    assert rail[1] & 1 << Flag.INPUT_AT_RAIL
    together = datapath.compute(np.stack([codes, codes[::-1]], axis=1))
    assert together.shape == (126, 2)
    assert together[:, 0].tolist() == datapath.compute(codes).tolist()


@pytest.mark.parametrize("steady", [True, False])
def test_the_c_model_takes_samples_at_the_higher_rate(steady: bool, tmp_path: Path) -> None:
    made = decimated()
    assert made.decimator is not None
    datapath = replace(made, decimator=replace(made.decimator, steady=steady))
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler is not None
    (tmp_path / "lowpass.h").write_text(c_header(datapath), encoding="utf-8")
    (tmp_path / "lowpass.c").write_text(c_source(datapath), encoding="utf-8")
    flags = ["-std=gnu99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "-o", "lowpass.so", "lowpass.c"], cwd=tmp_path, check=True)
    push = ctypes.CDLL(str(tmp_path / "lowpass.so")).lowpass_push
    push.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p]
    codes = np.random.default_rng(3).integers(-32768, 32768, 700)
    codes[100:120] = -32768
    state = ctypes.create_string_buffer(4096)
    result, status = ctypes.c_int64(), ctypes.c_uint8()
    found = [
        (result.value, status.value)
        for code in codes.tolist()
        if push(state, code, ctypes.byref(result), ctypes.byref(status))
    ]
    column = codes[:, np.newaxis]
    assert [code for code, _ in found] == datapath.compute(column).tolist()
    assert [flags for _, flags in found] == datapath.compute_status(column).tolist()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"factor": 12}, "factor must be a power of two from 2 on, not 12"),
        ({"factor": 1}, "factor must be a power of two from 2 on, not 1"),
        ({"stages": 0}, "stages must be at least 1, not 0"),
        ({"dropped": 7}, "dropped must be in 0..6, not 7"),
        ({"factor": 1024, "stages": 6}, "width must be at most 63 bits, not 68"),
    ],
)
def test_refusals(options: dict[str, int], sentence: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}$"):
        decimator(**options)


def test_a_datapath_takes_what_its_decimator_takes() -> None:
    other = Decimator(input=port(16, signed=True), factor=8, stages=3, dropped=9)
    sentence = f"inputs must be what the decimator takes, {other.input}, not {(INPUT,)}"
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}$"):
        replace(decimated(), decimator=other)
