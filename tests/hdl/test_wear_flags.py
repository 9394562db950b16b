"""The status of a sample: the same from the C model step by step, from its block, and from the hardware."""

import ctypes
import random
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES
from tests.hdl.core_bench import Pace, run_core

from sosmith.gen.architectures.architecture import Architecture
from sosmith.gen.core import design_core
from sosmith.gen.specification.specification import load
from sosmith.gen.word_lengths.settling import samples_to_settle
from sosmith.model.dataflow.c_model import c_header, c_source, state_bytes
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import Flag

SAMPLES = 30


def made(folder: Path, architecture: str, channels: int, start: str, protect: str) -> Architecture:
    """Design the bench's instrument with a filter of first order, and a calibration fitted to a part of its ranges."""
    rows = [
        f"{1.2 + 0.3 * voltage + 0.06 * voltage**2},{voltage},{temperature + voltage / 10}"
        for voltage in np.linspace(2.0, 8.0, 13)
        for temperature in (20.0, 50.0, 90.0)
    ]
    (folder / "measured.csv").write_text("\n".join(["clearance_mm,voltage_V,temperature_C", *rows]) + "\n")
    text = (EXAMPLES / "flange_wear_bench.toml").read_text(encoding="utf-8")
    calibration, rest = text.index("coefficients = ["), text.index("[filter]")
    path = folder / "spec.toml"
    path.write_text(text[:calibration] + 'data = "measured.csv"\n' + text[rest:], encoding="utf-8")
    spec = load(path)
    return design_core(
        replace(
            spec,
            channels=channels,
            filter=replace(spec.filter, order=1, cutoff=(Fraction(2),) if start == "zero" else spec.filter.cutoff),
            output=replace(spec.output, lsb=spec.output.lsb / 4),
            hardware=replace(
                spec.hardware,
                architecture=architecture,
                realization="df1_ef2",
                clock=Fraction(10**8),
                start=start,
                protect=protect,
            ),
        )
    ).architecture


def step_of(datapath: Datapath, folder: Path) -> Any:
    """Compile the C model as a user would; return the function that computes one sample."""
    name = datapath.name
    (folder / f"{name}.h").write_text(c_header(datapath), encoding="utf-8")
    (folder / f"{name}.c").write_text(c_source(datapath), encoding="utf-8")
    flags = ["-O2", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC", "-o", "model.so"]
    subprocess.run(["cc", *flags, f"{name}.c"], cwd=folder, check=True)
    step = ctypes.CDLL(str(folder / "model.so"))[f"{name}_step"]
    step.restype = ctypes.c_int64
    channel = [ctypes.c_size_t] if len(datapath.wear) > 1 else []
    step.argtypes = [ctypes.c_void_p, *channel, *[ctypes.c_int64] * len(datapath.inputs), ctypes.c_void_p]
    return step


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["parallel", "folded", pytest.param("serial", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("channels", "limits", "start", "protect"),
    [
        (1, 1, "steady", "none"),
        (3, 1, "steady", "none"),
        (3, 3, "steady", "none"),
        (1, 1, "zero", "none"),
        (3, 3, "zero", "none"),
        (1, 1, "zero", "correct"),
        pytest.param(3, 3, "zero", "correct", marks=pytest.mark.slow),
    ],
)
def test_a_sample_has_the_same_flags_everywhere(
    channels: int, limits: int, start: str, protect: str, architecture: str, tmp_path: Path
) -> None:
    plain = made(tmp_path, architecture, channels, start, protect)
    # The voltage goes from rail to rail and back, in each channel at another time; the temperature hardly changes.
    voltage, temperature = plain.datapath.inputs
    codes = np.empty((SAMPLES, channels, 2), dtype=np.int64)
    for n, c in np.ndindex(SAMPLES, channels):
        share = float(np.clip(2.6 * abs((n + 5 * c) % SAMPLES / SAMPLES - 0.5) - 0.15, 0.0, 1.0))
        codes[n, c] = round(share * voltage.highest), round((0.3 + 0.1 * share) * temperature.highest)
    results = plain.datapath.compute(codes)
    # Limits that the codes meet exactly, in each channel at other codes.
    met = [np.unique(column) for column in results.T]
    wear = tuple((int(met[c][5 + c]), int(met[c][11 - c])) for c in range(limits))
    core = replace(plain, datapath=replace(plain.datapath, wear=wear))
    datapath, flags = core.datapath, core.datapath.compute_status(codes)
    settling = flags >> Flag.SETTLING & 1
    assert settling.sum(axis=0).tolist() == [samples_to_settle(plain.datapath)] * channels
    assert not np.any(settling & (flags >> Flag.WEAR_WARNING | flags >> Flag.WEAR_CRITICAL))
    if start == "zero":
        assert np.any(settling & (results >= core.datapath.wear[0][0]))  # which a filter that has settled would tell
    for flag in set(Flag) - {Flag.FAULT, Flag.SETTLING}:
        for c in range(channels):
            assert {int(value) >> flag & 1 for value in flags[:, c]} == {0, 1}, (flag, c)

    # Each channel's samples in their order; which channel is next is left to chance.
    order = [c for c in range(channels) for _ in range(SAMPLES)]
    random.Random(5).shuffle(order)
    ways = [iter(range(SAMPLES)) for _ in range(channels)]
    places = [(next(ways[c]), c) for c in order]
    expected = [(c, int(results[n, c]), int(flags[n, c])) for n, c in places]

    step, status = step_of(datapath, tmp_path), ctypes.c_uint8()
    states = np.zeros((channels, state_bytes(datapath)), dtype=np.uint8)
    stepped = []
    for n, c in places:
        which = [c] if len(datapath.wear) > 1 else []
        code = step(states[c].ctypes.data, *which, *codes[n, c].tolist(), ctypes.byref(status))
        stepped.append((c, code, status.value))
    assert stepped == expected

    given = run_core(core, [(c, codes[n, c].tolist()) for n, c in places], Pace())
    assert sorted(given, key=lambda result: result.channel) == sorted(expected, key=lambda result: result[0])
