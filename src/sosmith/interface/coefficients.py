"""Filters from other tools' files, as second-order sections that say how they were read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from sosmith.gen.filter.factoring import factored
from sosmith.gen.specification.coefficients.content import Row, StatedSections, TransferFunction
from sosmith.gen.specification.coefficients.filter_file import read_filter_file
from sosmith.gen.specification.coefficients.signs import sentence, settled
from sosmith.interface.specification import Specification
from sosmith.model.errors import SpecificationError

_DIGITS = 60
"""Decimal digits up to which a coefficient is written exactly."""


@dataclass(frozen=True)
class Coefficients:
    r"""Stable second-order sections, or the taps of an FIR filter, read from a file; make one with `load`.

    Attributes
    ----------
    rows : tuple of tuples of Fraction
        (b0, b1, b2, 1, a1, a2), exact, in scipy's convention: the denominator is ``1 + a1/z + a2/z**2``. None of an
        FIR filter.
    notes : tuple of str
        How the file was read: its format, the signs of a1 and a2 and why, and the deviation where roots were found.
    sample_rate : Fraction or None
        In Hz, if it was given.
    taps : tuple of Fraction
        Of an FIR filter, exact; empty for sections.

    Examples
    --------
    >>> import pathlib, sosmith, tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name) / "equalizer.txt"
    >>> _ = path.write_text("biquad1,\nb0=0.25,\nb1=0.5,\nb2=0.25,\na1=0.2,\na2=-0.2\n")
    >>> read = sosmith.Coefficients.load(path, sample_rate=48000)
    >>> read.sos.tolist()
    [[0.25, 0.5, 0.25, 1.0, -0.2, 0.2]]
    >>> read.gains
    (1.0, 0.0)
    >>> read.specification(name="equalizer", unit="V").name
    'equalizer'
    >>> folder.cleanup()
    """

    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    sample_rate: Fraction | None = None
    taps: tuple[Fraction, ...] = ()

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        sample_rate: float | None = None,
        signs: Literal["auto", "scipy", "negated"] = "auto",
    ) -> Coefficients:
        """Read a file with a filter.

        Parameters
        ----------
        path : path
            ``.npy`` and ``.npz`` of NumPy; ``.mat`` of MATLAB with SOS and G; ``.json`` and ``.npz`` of pyfda; a
            ``.toml`` with an analog prototype; otherwise text: six or five columns, b and a, the exported text of
            MATLAB's filter designer, or biquads as from Room EQ Wizard and miniDSP.
        sample_rate : float or None
            In Hz, above 0; needed by an analog prototype.
        signs : str
            How a1 and a2 stand in the file: "scipy" for ``1 + a1/z + a2/z**2`` in the denominator, "negated" for the
            other sign, "auto" for the one that is stable, and that of the format if both are.

        Raises
        ------
        SpecificationError
            If the file cannot be read, holds no filter that can be recognized, or is not stable.
        """
        source = Path(fspath(path))
        content = read_filter_file(source)
        rate = None if sample_rate is None else Fraction(Decimal(repr(float(sample_rate))))
        if rate is not None and rate <= 0:
            raise SpecificationError(f"sample_rate must be a positive number of Hz, not {sample_rate:g}")
        asked = None if signs == "auto" else signs
        try:
            if isinstance(content, StatedSections):
                sections = settled(content, asked)
                return cls(sections.rows, (sentence(content, sections),), rate)
            if isinstance(content, TransferFunction) and content.taps is not None:
                return cls((), (f"{len(content.taps)} taps from {content.format}",), rate, content.taps)
            factorization = factored(content, rate)
            exact = tuple(tuple(Fraction(value) for value in row) for row in factorization.rows)
            sections = settled(StatedSections(format=content.format, rows=exact), "scipy")
        except SpecificationError as error:
            raise SpecificationError(f"{source}: {error}") from None
        except (OverflowError, ZeroDivisionError):  # responses beyond doubles
            raise SpecificationError(f"{source}: the filter must have numbers within reason, not beyond") from None
        return cls(
            sections.rows,
            (
                f"{len(sections.rows)} second-order sections factored from {content.format}, scipy's signs",
                f"their response is within {factorization.deviation:.1e} of the stated one, relative to its largest "
                "magnitude",
            ),
            rate,
        )

    @property
    def sos(self) -> npt.NDArray[np.float64]:
        """The sections as scipy's array, shape (sections, 6)."""
        return np.array([[float(value) for value in row] for row in self.rows], dtype=np.float64)

    def specification(self, **keys: Any) -> Specification:
        """Specify hardware for these sections or taps.

        Coefficients are stated exactly, up to 60 decimal digits.

        Parameters
        ----------
        **keys
            As for `Specification.from_sos` and `Specification.from_taps`; `sample_rate` only if `load` was given none.

        Raises
        ------
        SpecificationError
            If a value is invalid, or there is no sample rate.
        """
        if self.sample_rate is not None:
            keys = {"sample_rate": float(self.sample_rate)} | keys
        if "sample_rate" not in keys:
            raise SpecificationError("sample_rate must be given in Hz, not left out")
        if self.taps:
            return Specification.from_taps(cast("Any", [_decimal(value) for value in self.taps]), **keys)
        sos: Any = [[_decimal(value) for value in row] for row in self.rows]
        return Specification.from_sos(sos, **keys)

    @property
    def gains(self) -> tuple[float, float]:
        """Gain at 0 Hz and at half the sample rate, with sign; infinite if beyond doubles."""
        if self.taps:
            even, odd = (sum(self.taps[k::2], Fraction(0)) for k in (0, 1))
            return _double(even + odd), _double(even - odd)
        at_zero, at_half = Fraction(1), Fraction(1)
        for b0, b1, b2, _, a1, a2 in self.rows:
            at_zero *= (b0 + b1 + b2) / (1 + a1 + a2)
            at_half *= (b0 - b1 + b2) / (1 - a1 + a2)
        return _double(at_zero), _double(at_half)


def _double(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.copysign(math.inf, value)


def _decimal(value: Fraction) -> Decimal:
    """Write a double as it prints, another rational exactly if it has few digits, and otherwise rounded."""
    if Fraction(float(value)) == value:
        return Decimal(repr(float(value)))
    context = Context(prec=_DIGITS)
    return context.divide(Decimal(value.numerator), Decimal(value.denominator)).normalize(context)
