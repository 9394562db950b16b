"""Files of vectors: every format holds the same samples, the same bytes on every run."""

import io
import re
import wave
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.interface.small import filter_design, instrument_design

from sosmith.gen.output.core_facts import InterfaceFacts
from sosmith.gen.output.vectors import Vectors, hex_words, vector_files, whole_beats, words
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


def one_channel(lanes: int = 1, every: int = 1, copies: int = 1) -> InterfaceFacts:
    """Return the streams of the plain filter with so many samples in a beat, samples of a result, and copies of it."""
    made = filter_design().facts.interface
    return replace(
        made,
        inputs=replace(made.inputs, lanes=lanes),
        outputs=replace(made.outputs, lanes=lanes),
        samples_per_result=every,
        copies_per_result=copies,
    )


def samples(codes: list[int], results: list[int]) -> Vectors:
    stimuli, responses = np.array(codes)[:, np.newaxis, np.newaxis], np.array(results)[:, np.newaxis]
    return Vectors(
        stimuli=stimuli, responses=responses, status=(np.arange(len(results)) % 4)[:, np.newaxis].astype("u1")
    )


def test_a_beat_is_a_line_with_its_first_sample_lowest() -> None:
    vectors = samples([1, -2, 3, 4], [5, 6, -7, 8])
    assert hex_words(vectors, one_channel(lanes=2)) == (
        "fffe0001\n00040003\n",
        "0100_00060005\n0302_0008fff9\n",
    )
    wide = samples([*range(16)], [*range(16)])
    assert hex_words(wide, one_channel(lanes=16))[0] == "".join(f"{k:04x}" for k in range(15, -1, -1)) + "\n"


def test_the_last_sample_fills_the_last_beat() -> None:
    codes = np.array([[[1]], [[2]], [[3]]])
    assert whole_beats(codes, one_channel(lanes=2).inputs)[:, 0, 0].tolist() == [1, 2, 3, 3]
    assert whole_beats(codes, one_channel(lanes=16).inputs)[:, 0, 0].tolist() == [1, 2, *[3] * 14]
    assert whole_beats(codes, one_channel().inputs) is codes


DECIMATED = samples([1, 2, 3, 4, 5], [6, 7])
HELD = samples([1, 2, 3, 4, 5], [6, 6, 6, 6, 7, 7, 7, 7])


def test_rows_behind_a_decimator_are_empty_where_there_is_no_result() -> None:
    interface = one_channel(every=4)
    made = vector_files(Path("run.csv"), DECIMATED, interface, RATE)["run.csv"].decode()
    assert made.splitlines()[1:] == ["0,0,1,6,0", "1,0,2,,", "2,0,3,,", "3,0,4,,", "4,0,5,7,1"]
    assert [text.count("\n") for text in hex_words(DECIMATED, interface)] == [5, 2]


def test_rows_with_held_results_are_full() -> None:
    interface = one_channel(every=4, copies=4)
    made = vector_files(Path("run.csv"), HELD, interface, RATE)["run.csv"].decode()
    assert [row.split(",")[3] for row in made.splitlines()[1:]] == ["6", "6", "6", "6", "7"]
    assert [text.count("\n") for text in hex_words(HELD, interface)] == [5, 8]


def test_a_waveform_behind_a_decimator_changes_with_its_results() -> None:
    """In a waveform a result stays until the next one in any case."""
    made = vector_files(Path("run.vcd"), DECIMATED, one_channel(every=4), RATE)["run.vcd"].decode()
    identifier = next(line.split()[3] for line in made.splitlines() if " y_code " in line)
    changes = re.findall(rf"^b(\d+) {re.escape(identifier)}$|^#(\d+)$", made, re.MULTILINE)
    times, found = 0, []
    for value, time in changes:
        if time:
            times = int(time)
        else:
            found.append((times, int(value, 2)))
    assert found[-2:] == [(0, 6), (40_000_000, 7)]
    assert made.splitlines()[-1] == "#50000000"


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


def test_sound_has_the_codes_that_came_out_at_their_rate() -> None:
    def sound(vectors: Vectors, interface: InterfaceFacts, rate: Fraction = RATE) -> tuple[int, list[int]]:
        content = vector_files(Path("run.wav"), vectors, interface, rate)["run.wav"]
        with wave.open(io.BytesIO(content)) as file:
            return file.getframerate(), np.frombuffer(file.readframes(100), "<i2").tolist()

    bits = 16 - filter_design().facts.interface.outputs.fields[0].port.bits
    assert sound(samples([1, 2], [3, -4]), one_channel()) == (100, [3 << bits, -4 << bits])
    assert sound(DECIMATED, one_channel(every=4)) == (25, [6 << bits, 7 << bits])
    assert sound(HELD, one_channel(every=4, copies=4))[0] == 100
    message = r"^run\.wav: the sample rate of a WAV file must be a whole number of Hz, not 33\.3333333333$"
    with pytest.raises(SpecificationError, match=message):
        sound(DECIMATED, one_channel(every=3))


def test_negative_codes_are_extended_to_whole_bytes() -> None:
    stream = filter_design().facts.interface.inputs
    assert [f"{word:04x}" for word in words(np.array([[-1], [-512], [511]]), stream)] == ["ffff", "fe00", "01ff"]


def test_an_unknown_format_is_refused() -> None:
    message = r"^run\.fst: a file of vectors must end in \.csv, \.npz, \.vcd, \.hex, \.wav, not '\.fst'$"
    with pytest.raises(SpecificationError, match=message):
        files("run.fst")
