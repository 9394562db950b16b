"""Files of vectors: every format holds the same samples, the same bytes on every run."""

import io
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.interface.small import filter_design, instrument_design

from sosmith.gen.output.vectors import Vectors, hex_words, vector_files, words
from sosmith.model.errors import SpecificationError

VECTORS = Vectors(
    stimuli=np.array([[[1, 2], [3, 4]], [[4095, 1023], [0, 0]]]),
    responses=np.array([[5, 6], [0, 4095]]),
    status=np.array([[0, 1], [2, 0x41]], dtype=np.uint8),
)
RATE = Fraction(100)


def files(name: str) -> dict[str, bytes]:
    return vector_files(Path(name), VECTORS, instrument_design().facts.interface, RATE)


def test_hex_has_a_transfer_in_each_line() -> None:
    made = files("run.hex")
    assert list(made) == ["run_stimuli.hex", "run_responses.hex"]
    assert made["run_stimuli.hex"] == b"00_00020001\n01_00040003\n00_03ff0fff\n01_00000000\n"
    assert made["run_responses.hex"] == b"00_00_0005\n01_01_0006\n00_02_0000\n01_41_0fff\n"


def test_one_channel_has_no_destination() -> None:
    interface = instrument_design().facts.interface
    alone = replace(
        interface, inputs=replace(interface.inputs, dest_width=0), outputs=replace(interface.outputs, dest_width=0)
    )
    one = Vectors(stimuli=VECTORS.stimuli[:, :1], responses=VECTORS.responses[:, :1], status=VECTORS.status[:, :1])
    assert hex_words(one, alone) == ("00020001\n03ff0fff\n", "00_0005\n02_0000\n")


def test_csv_has_a_row_for_each_sample_of_each_channel() -> None:
    assert files("run.csv")["run.csv"].decode().splitlines() == [
        "sample,channel,voltage_code,temperature_code,clearance_code,status",
        "0,0,1,2,5,0",
        "0,1,3,4,6,1",
        "1,0,4095,1023,0,2",
        "1,1,0,0,4095,65",
    ]


def test_npz_has_the_arrays_and_the_same_bytes() -> None:
    content = files("run.npz")["run.npz"]
    assert content == files("run.npz")["run.npz"]
    loaded = np.load(io.BytesIO(content))
    for name in ("stimuli", "responses", "status"):
        assert np.array_equal(loaded[name], getattr(VECTORS, name))


def test_vcd_has_the_codes_at_the_times_of_the_samples() -> None:
    lines = files("run.vcd")["run.vcd"].decode().splitlines()
    assert lines == files("run.vcd")["run.vcd"].decode().splitlines()
    identifier = next(line.split()[3] for line in lines if " voltage_code " in line)
    second = lines[lines.index("#10000000") :]
    assert f"b111111111111 {identifier}" in second
    assert lines[-1] == "#20000000"


def test_negative_codes_are_extended_to_whole_bytes() -> None:
    stream = filter_design().facts.interface.inputs
    assert [f"{word:04x}" for word in words(np.array([[-1], [-512], [511]]), stream)] == ["ffff", "fe00", "01ff"]


def test_an_unknown_format_is_refused() -> None:
    message = r"^run\.fst: a file of vectors must end in \.csv, \.npz, \.vcd, \.hex, not '\.fst'$"
    with pytest.raises(SpecificationError, match=message):
        files("run.fst")
