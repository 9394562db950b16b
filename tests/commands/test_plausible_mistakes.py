"""Mistakes that a newcomer makes on the first day: each is answered by one true sentence that names the cure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile
import scipy.signal
from click.testing import CliRunner

from sosmith.cli import cli
from sosmith.model.errors import SosmithError

SPEC = """\
name = "bass"
sample_rate = 48000
[input.x]
bits = 16
signed = true
range = [-1.0, 1.0]
[filter]
family = "butterworth"
kind = "lowpass"
order = 2
cutoff = 1000.0
[output]
bits = 16
signed = true
range = [-1.0, 1.0]
[hardware]
realization = "df1"
architecture = "parallel"
"""

# What is replaced in the specification, by what, and the answer; a full stop stands for any text.
SPECIFICATIONS = [
    ("cutoff = 1000.0", 'cutoff = "1 kHz"', "filter.cutoff must be a number of Hz, .*: write 1000, without quotes .*"),
    ("cutoff = 1000.0", "cutoff = 1 kHz", "line 11 must be a number without a unit: cutoff = 1000"),
    ("cutoff = 1000.0", "cutoff = 1k", "line 11 must be a number without a unit: cutoff = 1000"),
    ("cutoff = 1000.0", "cutoff = 1000 Hz  # corner", "line 11 must be a number without a unit: cutoff = 1000"),
    ("cutoff = 1000.0", "cutoff = 0,5", "line 11 must be a number with a decimal point: cutoff = 0.5"),
    ("cutoff = 1000.0", "cutoff = 0", "filter.cutoff must be above 0 and below half the sample_rate .*, not 0"),
    ("cutoff = 1000.0", "cutoff = 30000", "filter.cutoff must be above 0 and below half .* .24000 Hz., not 30000"),
    ("cutoff = 1000.0", "cutoff = [100, 1000]", "filter.cutoff must be one frequency for lowpass, not .100, 1000."),
    ("cutoff = 1000.0", "", "filter.cutoff must be given together with order, not missing"),
    ("cutoff", "cutof", "filter.cutof must be one of the keys .*, not an unknown one .did you mean cutoff..(?s:.*)"),
    ("cutoff", "frequency", "filter.frequency must be one of the keys family, kind, .*"),
    ("sample_rate = 48000", 'sample_rate = "48k"', "sample_rate must be a positive number of Hz, .*: write 48000, .*"),
    ("sample_rate = 48000", "sample_rate = 48 kHz", "line 2 must be a number without a unit: sample_rate = 48000"),
    ("sample_rate = 48000", "sample_rate = 48,000", "line 2 must be a number without commas: sample_rate = 48000"),
    ("sample_rate = 48000", "sample_rate: 48000", "line 2 must be a key, an equals sign and a value, as in .*"),
    ("sample_rate = 48000", "fs = 48000", "fs must be one of the keys name, (?s:.*)sample_rate must be .*"),
    ("sample_rate = 48000", "sample_rate = -1", "sample_rate must be a positive number of Hz, not -1"),
    ("order = 2", "order = 2.5", "filter.order must be a whole number from 1 to 20, not 2.5"),
    ("order = 2", 'order = "2"', "filter.order must be a whole number .*, not '2': write 2, without quotes and unit"),
    ("order = 2", "order = 40", "filter.order must be a whole number from 1 to 20, not 40"),
    ("order = 2", "ordre = 2", "filter.ordre must be one of the keys .* .did you mean order.."),
    ("order = 2", "order 2", "line 10 must be a key, an equals sign and a value: order = 2"),
    ('"lowpass"', '"low-pass"', "filter.kind must be one of lowpass, .*, not 'low-pass' .did you mean lowpass.."),
    ('"lowpass"', '"LP"', "filter.kind must be one of .*, not 'LP' .did you mean lowpass.."),
    ('"lowpass"', '"lowpass', "line 9 must end its text with the quote that begins it"),
    ('"lowpass"', "lowpass", 'line 9 must be a text in quotes: kind = "lowpass"'),
    ('"lowpass"', '"bandpass"', "filter.cutoff must be two frequencies .low, high. for bandpass, not 1000"),
    ('"butterworth"', '"FIR"', "filter.family must be one of .*, not 'FIR' .did you mean equiripple or kaiser.."),
    ('"butterworth"', '"Butterworth"', "filter.family must be one of .*, not 'Butterworth' .did you mean butter.*"),
    ('"butterworth"', '"cheby1"', "filter.family must be one of .*, not 'cheby1' .did you mean chebyshev1.."),
    ('"butterworth"', '"elliptic"', "filter.passband_loss must be given in dB with order and cutoff for elliptic, .*"),
    ('"butterworth"', "'butterworth", "line 8 must end its text with the quote that begins it"),
    (
        "bits = 16\nsigned = true\nrange = [-1.0, 1.0]\n[filter]",
        "bits = 64\nsigned = true\nrange = [-1.0, 1.0]\n[filter]",
        "input.x.bits must be a whole number from 2 to 32, not 64",
    ),
    ("[input.x]\nbits = 16", "[input.x]\nbits = 16 bits", "line 4 must be a number without a unit: bits = 16"),
    (
        "[input.x]\nbits = 16",
        "[input.x]\nwidth = 16",
        "input.x.width must be one of the keys bits, (?s:.*)bits must be.*",
    ),
    (
        "[input.x]\nbits = 16\nsigned = true",
        "[input.x]\nbits = 16\nsigned = yes",
        "line 5 must be true or false: signed = true",
    ),
    (
        "[input.x]\nbits = 16\nsigned = true",
        "[input.x]\nbits = 16\nsigned = True",
        "line 5 must be true or false: signed = true",
    ),
    (
        "[input.x]\nbits = 16\nsigned = true",
        '[input.x]\nbits = 16\nsigned = "true"',
        "input.x.signed must be true or false, not 'true': write true",
    ),
    (
        "[input.x]\nbits = 16\nsigned = true\nrange = [-1.0, 1.0]",
        "[input.x]\nbits = 16\nsigned = true\nrange = [0, 1]",
        "input.x.range must be symmetric, .-high, high., where signed = true, not .0, 1.",
    ),
    (
        "[input.x]\nbits = 16\nsigned = true\nrange = [-1.0, 1.0]",
        "[input.x]\nbits = 16\nsigned = true\nrange = 1.0",
        "input.x.range must be a list of 2 numbers, not 1.0",
    ),
    ("[input.x]", "[input]", "input.bits must be a table, not 16(?s:.*)"),
    ("[input.x]", "[input.1x]", "input.1x must be named by a Verilog identifier .*"),
    (
        "[filter]",
        "[fitler]",
        "fitler must be one of the keys .* .did you mean filter..(?s:.*)filter must be a table .*",
    ),
    ("[output]", "[outputs]", "outputs must be one of .* .did you mean output..(?s:.*)output must be a table .*"),
    ("[output]", "[output]\nmax_error = 0", "output.max_error must be .*, not 0"),
    ("[output]", "[output]\nmax_error = 1e-6", "output.max_error must be more than half an LSB of the output .*"),
    ('"bass"', '"my filter"', "name must be a Verilog identifier of at most 64 letters, .*, not 'my filter'"),
    ('"bass"', '"module"', "name must be a Verilog identifier .*"),
    ('"df1"', '"df2"', "hardware.realization must be one of auto, .*, not 'df2' .did you mean df2t.."),
    ('"parallel"', '"pipelined"', "hardware.architecture must be one of .*, not 'pipelined'.*"),
    ("[hardware]", "[hardware]\nclock = 12 MHz", "line 17 must be a number without a unit: clock = 12000000"),
    ("[hardware]", "[hardware]\nclock = 1000", "hardware.clock must be at least the sample_rate .48000 Hz., not 1000"),
    ("[hardware]", "[hardware]\nreload = 1", "hardware.reload must be true or false, not 1: write true"),
    (SPEC, "", "the specification must have keys, not be empty"),
]

# Arguments, and the answer.
COMMANDS = [
    (["design", "missing.toml"], "missing.toml: the specification must be a readable file, not: no such file .*"),
    (["design", "."], ".: the specification must be a readable file, not: is a directory"),
    (["desing", "good.toml"], "No such command 'desing' .did you mean design.*"),
    (["design", "good.toml", "--board", "icebraker"], "the board must be one of .* .did you mean icebreaker.."),
    (["design", "good.toml", "--realization", "df2"], "Invalid value for '--realization': .* .did you mean df2t.*"),
    (["simulate", "good.toml", "--trace", "sweeep"], "scenario .* must be one of .*, not 'sweeep'.*"),
    (
        ["simulate", "good.toml", "--trace", "cd.wav"],
        "cd.wav: the sample rate must be the 48000 Hz of the specification, not 44100 Hz; state sample_rate = 44100 .*",
    ),
    (
        ["simulate", "good.toml", "--trace", "stereo.wav"],
        "stereo.wav: the channels must be the 1 of the design, or one that drives all, not 2; state channels = 2 .*",
    ),
    (["simulate", "good.toml", "--trace", "song.mp3"], "song.mp3: sound must be a WAV file, not .mp3; convert it, .*"),
    (["simulate", "good.toml", "--trace", "missing.wav"], "missing.wav: the WAV file must be a readable file, not: .*"),
    (["simulate", "good.toml", "--vectors", "out.mp3"], "out.mp3: a file of vectors must end in .*, .wav, not '.mp3'"),
    (["emulate", "good.toml", "tome"], "the scenario must be one of .* .did you mean tone.*"),
    (["import", "good.toml"], "Missing option '--sample-rate'."),
    (["import", "tone.wav", "--sample-rate", "48000"], "tone.wav: the filter must be .*, not a recording .*"),
    (["import", "other.mat", "--sample-rate", "48000"], "other.mat: variables must be SOS, .*, not only response"),
    (["import", "rew.txt", "--sample-rate", "48000"], "rew.txt: the filter .* Room EQ Wizard's .*: export .*"),
    (["import", "x.xlsx", "--sample-rate", "48000"], "x.xlsx: .*, not a spreadsheet: save it as CSV"),
]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("good.toml").write_text(SPEC, encoding="utf-8")


def answer(*arguments: str) -> str:
    """Return what a command says that is refused."""
    result = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert result.exception is not None, result.output
    if isinstance(result.exception, SosmithError):
        assert result.exception.exit_status == 2
        return str(result.exception)
    return str(getattr(result.exception, "format_message", lambda: repr(result.exception))())


def test_the_list_is_as_long_as_was_promised() -> None:
    assert len(SPECIFICATIONS) + len(COMMANDS) >= 60


@pytest.mark.parametrize(("old", "new", "expected"), SPECIFICATIONS)
def test_a_mistake_in_a_specification(old: str, new: str, expected: str) -> None:
    assert SPEC.count(old) == 1
    Path("a.toml").write_text(SPEC.replace(old, new), encoding="utf-8")
    said = answer("design", "a.toml")
    assert re.fullmatch(f"a.toml: {expected}", said), said


@pytest.mark.parametrize(("arguments", "expected"), COMMANDS)
def test_a_mistake_on_the_command_line(arguments: list[str], expected: str) -> None:
    Path("tone.wav").write_bytes(b"RIFF\x24\x00\x00\x00WAVEfmt ")
    scipy.io.wavfile.write("cd.wav", 44100, np.zeros(10, np.int16))
    scipy.io.wavfile.write("stereo.wav", 48000, np.zeros((10, 2), np.int16))
    Path("x.xlsx").write_bytes(b"PK")
    Path("rew.txt").write_text("Filter Settings file\n\nRoom EQ V5.20\nFilter  1: ON  PK  Fc 63 Hz\n", encoding="utf-8")
    scipy.io.savemat("other.mat", {"response": np.ones(5)})
    said = answer(*arguments)
    assert re.fullmatch(expected, said), said


@pytest.mark.parametrize("output", ["ba", "zpk"])
def test_matlabs_other_forms_of_a_filter_are_read(output: str) -> None:
    parts = scipy.signal.butter(3, 0.2, output=output)
    scipy.io.savemat("filter.mat", dict(zip(output if output == "ba" else "zpk", parts, strict=True)))
    result = CliRunner().invoke(cli, ["import", "filter.mat", "--sample-rate", "48000", "-o", "read.toml"])
    assert result.exit_code == 0, result.output
    assert "gain 1 at 0 Hz" in result.output
