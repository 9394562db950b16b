"""Small certificates for Rocq, and the mark of tests that need it."""

import shutil
from fractions import Fraction

import pytest
from tests.gen.word_lengths.filters import butterworth, plain

from sosmith.gen.output.certificate import certificate
from sosmith.verify.certificate_file import Certificate

needs_coqc = pytest.mark.skipif(shutil.which("coqc") is None, reason="there is no coqc on this machine")

GRID = Fraction(1, 1 << 64)


def small(realization: str = "df1", order: int = 3, *, steady: bool = False) -> Certificate:
    """Return the certificate of a low-pass filter that settles soon."""
    quantized = plain(butterworth(order, 0.2), realization, steady=steady)
    return certificate(quantized, quantized.datapath.output.lsb)


def with_gain(made: Certificate, section: int, **gains: Fraction) -> Certificate:
    """Return a certificate with other claims of a section's gains."""
    entries = list(made.claims.sections)
    entries[section] = entries[section].model_copy(update=gains)
    return made.model_copy(update={"claims": made.claims.model_copy(update={"sections": tuple(entries)})})
