"""A datapath before a decimator: every sample goes through it, and its flags are gathered with the results."""

import ctypes
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.model.dataflow.decimators import decimated
from tests.model.datapaths import INPUT

from sosmith.model.dataflow.c_model import c_header, c_source
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.port import Port
from sosmith.model.sections.horner import HornerPolynomial, Variable
from sosmith.model.sections.output import OutputStage

V = Port(name="voltage", bits=8, signed=False, lsb=INPUT.lsb, zero=INPUT.zero)
T = Port(name="temperature", bits=6, signed=True, lsb=INPUT.lsb, zero=INPUT.zero)
ROWS = ((12_000, -9_000), (70_000, 33_333), (-90_001,), (5_000,))
LIMITS = ((3, 250), (-32, 20))


def calibration() -> Datapath:
    """Return a polynomial whose result the decimator of `decimated` takes."""
    variables = tuple(Variable(name=p.name, bits=p.bits, signed=p.signed) for p in (V, T))
    stages = HornerPolynomial(coefficients=ROWS, frac=3, variables=variables).stages
    (x,) = stages[-1].graph.output_ranges
    last = OutputStage(offset=0, offset_frac=x.frac, x=x, low=INPUT.lowest, high=INPUT.highest)
    return Datapath(name="lowpass_ahead", inputs=(V, T), output=INPUT, stages=(*stages, last), calibrated=LIMITS)


def instrument(**changes: Any) -> Datapath:
    """Return the decimated low-pass filter with the polynomial before it."""
    ahead = calibration()
    given: dict[str, Any] = {"inputs": (V, T), "calibrated": LIMITS, "calibration": ahead}
    return replace(decimated(), **given | changes)


def codes_for(count: int) -> np.ndarray:
    rng = np.random.default_rng(8)
    codes = np.stack([rng.integers(20, 200, count), rng.integers(-30, 15, count)], axis=1)
    codes[count // 2 : count // 2 + 30] = [120, -12]
    return codes


def flagged() -> tuple[np.ndarray, list[int]]:
    """Return codes of which a few have flags, and the flags of each of their results."""
    codes = codes_for(65)
    codes[0] = [255, 0]  # at a rail, outside
    codes[1, 1] = -32  # at a rail: counts for result 1, as sample 8
    codes[8, 0] = 1  # outside
    codes[20, 1] = 21  # outside: result 3
    codes[64, 0] = 0  # at a rail, outside: the last one
    return codes, [3, 3, 0, 2, 0, 0, 0, 0, 3]


def test_results_are_those_of_its_parts() -> None:
    datapath = instrument()
    assert datapath.calibration is not None
    assert datapath.decimator is not None
    codes = codes_for(1001)
    column = datapath.calibration.compute(codes)
    assert (column.min(), column.max()) != (0, 0)
    entering = datapath.decimator.compute(column)[:, np.newaxis]
    found = datapath.behind_decimator.compute(entering)
    assert datapath.compute(codes).tolist() == found.tolist() == datapath.compute_exact(codes)
    both = np.stack([codes, codes[::-1]], axis=1)
    assert datapath.compute(both)[:, 1].tolist() == datapath.compute(codes[::-1]).tolist()
    assert datapath.decimated_range == datapath.calibration.result_range
    assert decimated().decimated_range == (INPUT.lowest, INPUT.highest)


def test_a_result_tells_of_the_flags_of_all_its_samples() -> None:
    codes, expected = flagged()
    assert (instrument().compute_status(codes) & 3).tolist() == expected
    both = np.stack([codes, codes_for(65)], axis=1)
    assert (instrument().compute_status(both) & 3).T.tolist() == [expected, [0] * 9]


def compiled(datapath: Datapath, folder: Path) -> Any:
    """Compile the C model, and return its function that takes samples at the higher rate."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler is not None
    (folder / "lowpass.h").write_text(c_header(datapath), encoding="utf-8")
    (folder / "lowpass.c").write_text(c_source(datapath), encoding="utf-8")
    flags = ["-std=gnu99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "-o", "lowpass.so", "lowpass.c"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "lowpass.so")).lowpass_push


def pushed(push: Any, codes: np.ndarray, *channel: int) -> list[tuple[int, int]]:
    """Return results and status that the C model gives for the samples of a channel."""
    push.argtypes = [ctypes.c_void_p, *([ctypes.c_size_t] * len(channel)), *([ctypes.c_int64] * 2)]
    push.argtypes += [ctypes.c_void_p] * 2
    state = ctypes.create_string_buffer(4096)
    result, status = ctypes.c_int64(), ctypes.c_uint8()
    return [
        (result.value, status.value)
        for v, t in codes.tolist()
        if push(state, *channel, v, t, ctypes.byref(result), ctypes.byref(status))
    ]


def test_the_c_model_takes_every_sample(tmp_path: Path) -> None:
    datapath = instrument()
    codes = np.concatenate([flagged()[0], codes_for(500)])
    found = pushed(compiled(datapath, tmp_path), codes)
    assert [code for code, _ in found] == datapath.compute(codes).tolist()
    assert [flags for _, flags in found] == datapath.compute_status(codes).tolist()
    header = c_header(datapath)
    assert "voltage_code: 0 .. 255" in header
    assert "calibration\n * and the decimator" in header


def test_the_c_model_judges_the_wear_of_each_channel(tmp_path: Path) -> None:
    limits = ((2000, 9000), (-20_000, 20_000), (-9000, 2000))
    datapath = instrument(wear=limits)
    push = compiled(datapath, tmp_path)
    codes = np.stack([codes_for(400), codes_for(400)[::-1], codes_for(401)[1:]], axis=1)
    status = datapath.compute_status(codes)
    assert {flags >> 3 & 3 for flags in status.ravel().tolist()} == {0, 1, 3}
    for channel in range(3):
        found = pushed(push, codes[:, channel], channel)
        assert [code for code, _ in found] == datapath.compute(codes)[:, channel].tolist()
        assert [flags for _, flags in found] == status[:, channel].tolist()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"decimator": None}, "calibration must be left out where there is no decimator"),
        (
            {"calibration": replace(calibration(), output=replace(INPUT, name="other"))},
            f"calibration must give what the decimator takes, {INPUT}, not {replace(INPUT, name='other')}",
        ),
        (
            {"inputs": (T, V)},
            f"calibration must take the inputs, {((T, V), LIMITS)}, not {((V, T), LIMITS)}",
        ),
        (
            {"calibrated": ()},
            f"calibration must take the inputs, {((V, T), ((0, 255), (-32, 31)))}, not {((V, T), LIMITS)}",
        ),
        (
            {"calibration": replace(decimated(), decimator=None), "inputs": (INPUT,), "calibrated": ()},
            "calibration must be without memory, which one sample alone fills, and without a decimator",
        ),
        (
            {"calibration": decimated(), "inputs": (INPUT,), "calibrated": ()},
            "calibration must be without memory, which one sample alone fills, and without a decimator",
        ),
        ({"calibration": None}, f"inputs must be what the decimator takes, {INPUT}, not {(V, T)}"),
    ],
)
def test_refusals(changes: dict[str, Any], sentence: str) -> None:
    if "calibration" in changes and changes["calibration"] is not None and "inputs" in changes:
        changes["calibration"] = replace(changes["calibration"], output=INPUT)
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}$"):
        instrument(**changes)
