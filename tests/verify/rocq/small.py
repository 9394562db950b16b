"""Small certificates for Rocq, and the mark of tests that need it."""

import shutil
import subprocess
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import pytest
from tests.gen.word_lengths.filters import butterworth, fir_spec, plain

from sosmith.gen.core import design_core
from sosmith.gen.filter.design import design
from sosmith.gen.output.certificate import certificate
from sosmith.gen.specification.specification import from_text
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.model.polynomial import Polynomial
from sosmith.model.port import Port
from sosmith.sim.build_cache import BuildCache, cache_folder, key_of
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.rocq.check import DATA, head, theorems
from sosmith.verify.rocq.claims import Claim
from sosmith.verify.rocq.kernel import THEORIES, compile_theories, ending, mark, run_kernel, theory_texts

needs_coqc = pytest.mark.skipif(shutil.which("coqc") is None, reason="there is no coqc on this machine")

GRID = Fraction(1, 1 << 64)

TAPS = ("0.05", "0.2", "0.37", "0.2", "0.05")
"""Of a low-pass filter."""


SETTLING = """
name = "from_zero"
sample_rate = 1.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 0.2 }
output = { bits = 8, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware = { start = "zero", realization = "df1" }
"""
"""A filter that flags its first samples."""

DECIMATED = """
name = "decimated"
sample_rate = 1.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", order = 2, cutoff = 0.04, decimate = 4 }
output = { bits = 8, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware = { realization = "df1" }
"""
"""A filter behind a decimator."""


def from_zero(text: str) -> str:
    """Return one of these specifications with a start from zero."""
    return text.replace("hardware = {", 'hardware = { start = "zero",')


DOWNSAMPLED = """
name = "downsampled"
sample_rate = 1.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { taps = [0.05, 0.2, 0.37, 0.2, 0.05], decimate = 2 }
output = { bits = 8, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware = { architecture = "folded" }
"""
"""An FIR filter of which every second result leaves."""

BOTH = """
name = "calibrated"
sample_rate = 100.0
input.voltage = { bits = 8, range = [0.0, 10.0] }
input.temperature = { bits = 8, range = [0.0, 128.0] }
calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]
filter = { family = "butterworth", kind = "lowpass", order = 1, cutoff = 4.0, decimate = 4 }
output = { bits = 8, range = [0.0, 16.0], unit = "mm", max_error = "faithful" }
"""
"""A calibration before a decimator before a filter."""


BAND_STOP = """
name = "band_stop"
sample_rate = 1.0
input.x = { bits = 4, signed = true, range = [-1.0, 1.0] }
output = { bits = 17, signed = true, range = [-1.0, 1.0], unit = "", max_error = "faithful" }
hardware = { start = "zero", realization = "lattice_wdf" }

[filter]
family = "chebyshev2"
kind = "bandstop"
order = 5
cutoff = [0.089008, 0.168014]
stopband_loss = 50.0
"""
"""A section of order 2 behind two of order 4, whose denominators have twice as many bits."""


def designed(text: str) -> Certificate:
    """Return the certificate of a specification."""
    made = design_core(from_text(text, Path("small.toml")))
    return certificate(made.quantized, made.spec.max_error)


def _compile(folder: Path) -> None:
    """Compile all theories in an empty folder."""
    for name, text in theory_texts().items():
        (folder / name).write_text(text, encoding="utf-8")
    compile_theories(folder)


def library(folder: Path) -> None:
    """Put the compiled theories into a folder; they are kept between runs, for the same texts and the same Rocq."""
    version = subprocess.run(["coqc", "--print-version"], capture_output=True, text=True, check=True).stdout
    place = cache_folder()
    if place is None:
        _compile(folder)
        return
    with BuildCache(place).entry("theories", key_of(version, theory_texts()), _compile) as made:
        for name in THEORIES:
            shutil.copy(made / f"{name}.vo", folder)


def checked(made: Certificate, folder: Path, claims: Sequence[Claim] | None = None) -> set[str]:
    """Have Rocq check a certificate's theorems, or some of them; return the axioms."""
    library(folder)
    written = theorems(made)
    chosen = written.claims if claims is None else claims
    parts = [f"{claim.text}{mark(claim)}" for claim in chosen]
    text = "".join([head(), written.definitions, *parts, ending([claim.name for claim in chosen])])
    (folder / f"{DATA}.v").write_text(text, encoding="utf-8")
    return set(run_kernel(folder, chosen, DATA, theories=()).axioms)


def small(realization: str = "df1", order: int = 3, *, steady: bool = False) -> Certificate:
    """Return the certificate of a low-pass filter that settles soon; of a short FIR filter if that is so realized."""
    ideal = design(fir_spec(TAPS), 1.0) if realization.startswith("fir") else butterworth(order, 0.2)
    quantized = plain(ideal, realization, steady=steady)
    return certificate(quantized, quantized.datapath.output.lsb)


def coarse(*, steady: bool = False) -> Certificate:
    """Return the certificate of a filter whose output has more bits than its input: one code of that is many of it."""
    inputs = Port.from_range("x", 6, Fraction(-1), Fraction(1), signed=True)
    output = Port.from_range("y", 20, Fraction(-1), Fraction(1), signed=True)
    return certificate(plain(butterworth(1, 0.2), "df1", inputs, output, steady=steady), output.lsb)


def calibrated() -> Certificate:
    """Return the certificate of a calibration of two inputs before a low-pass filter, its output from -8 on."""
    inputs = (
        Port.from_range("voltage", 12, Fraction(0), Fraction(10)),
        Port.from_range("temperature", 10, Fraction(-40), Fraction(215)),
    )
    output = Port.from_range("d", 12, Fraction(-8), Fraction(24))
    quantized = quantize(
        name="calibrated",
        inputs=inputs,
        output=output,
        max_error=output.lsb,
        ideal=butterworth(2, 0.1),
        polynomial=Polynomial.from_numbers([["1.16", "-0.0036"], ["0.3672", "0.0006618"], ["0.05812"]]),
        realization="df1",
        steady=True,
    )
    return certificate(quantized, output.lsb)


def with_gain(made: Certificate, section: int, **gains: Fraction) -> Certificate:
    """Return a certificate with other claims of a section's gains."""
    entries = list(made.claims.sections)
    entries[section] = entries[section].model_copy(update=gains)
    return made.model_copy(update={"claims": made.claims.model_copy(update={"sections": tuple(entries)})})
