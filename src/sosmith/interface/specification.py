"""Specifications from a TOML file, from a dict, or from second-order sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sosmith.gen.facts.table import Table, View
from sosmith.gen.specification.choices import (
    ARCHITECTURES,
    FAMILIES,
    FIR_FAMILIES,
    FREEDOMS,
    KINDS,
    LOSSES,
    METHODS,
    REALIZATIONS,
    STARTS,
)
from sosmith.gen.specification.combinations import Combination, combinations
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.specification import Specification as Checked
from sosmith.gen.specification.specification import example, from_text, from_tree, load
from sosmith.interface.quantity import Quantity
from sosmith.model.errors import SpecificationError

__all__ = ["Combination", "Specification", "specification_of"]

if TYPE_CHECKING:
    import numpy.typing as npt

    from sosmith.interface.filter import Filter

_UNNAMED = Path("specification")
"""Name in messages for a specification that does not come from a file."""


@dataclass(frozen=True)
class Specification(View):
    """A checked specification; make one with `load`, `from_sos` or `example`.

    It is checked completely when it is made, and is immutable. The keys are those of the TOML file: `sosmith init`
    writes one with a comment on every key.

    Examples
    --------
    >>> import sosmith
    >>> spec = sosmith.Specification.load({
    ...     "name": "notch",
    ...     "sample_rate": 1000,
    ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
    ...     "filter": {"family": "butterworth", "kind": "bandstop", "order": 1, "cutoff": [45.0, 55.0]},
    ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
    ... })
    >>> spec
    <sosmith.Specification notch: x -> y at 1000 Hz>
    >>> print(spec.max_error)
    0.0004883
    >>> sosmith.Specification.load(spec.as_dict() | {"sample_rate": -1})
    Traceback (most recent call last):
    ...
    sosmith.model.errors.SpecificationError: specification: sample_rate must be a positive number of Hz, not -1
    """

    checked: Checked = field(repr=False)
    """The same specification with every number as an exact `fractions.Fraction`."""

    @classmethod
    def load(cls, source: str | PathLike[str] | Mapping[str, Any]) -> Specification:
        """Read and check a TOML file, or a dict with the same keys.

        Parameters
        ----------
        source : path or mapping
            Path of the file, or its content. A float is taken as the shortest decimal number that reads back as the
            same float, and a numpy array as a list.

        Raises
        ------
        SpecificationError
            For all errors of the keys, with the path of each, what was expected and what was found.
        """
        if isinstance(source, Mapping):
            return cls(from_tree(exact(source), _UNNAMED))
        return cls(load(Path(path_of(source, "the specification must be a path, a dict or a Specification"))))

    @classmethod
    def from_toml(cls, text: str, path: str | PathLike[str] = _UNNAMED) -> Specification:
        """Check the text of a TOML file.

        Parameters
        ----------
        text : str
            The text.
        path : path
            Name of the file in messages, which need not exist; files that the text names are relative to its folder.

        Raises
        ------
        SpecificationError
            As `load`.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.Specification.from_toml("name = 3", "my.toml")
        Traceback (most recent call last):
        ...
        sosmith.model.errors.SpecificationError: my.toml: name must be ..., not 3...
        """
        return cls(from_text(text, Path(fspath(path))))

    @classmethod
    def from_sos(
        cls,
        sos: npt.ArrayLike,
        sample_rate: float,
        *,
        name: str = "sos_filter",
        channels: int = 1,
        input_bits: int = 16,
        input_range: tuple[float, float] = (-1.0, 1.0),
        output_bits: int | None = None,
        output_range: tuple[float, float] | None = None,
        unit: str = "",
        max_error: float | Literal["faithful"] = "faithful",
        realization: str = "auto",
        architecture: str = "auto",
        clock: float = 12e6,
    ) -> Specification:
        """Specify hardware for given second-order sections, such as those from scipy.

        Parameters
        ----------
        sos : array_like, shape (sections, 6)
            1 to 10 stable rows ``[b0, b1, b2, 1, a1, a2]``, as returned by ``scipy.signal.butter(..., output="sos")``.
        sample_rate : float
            Samples per second of each channel, in Hz.
        name : str
            Name of the top module and of the files, a Verilog identifier.
        channels : int
            Number of channels that share the hardware, 1 to 65536.
        input_bits, output_bits : int
            Bits per code, 2 to 32; by default the output has as many as the input.
        input_range, output_range : tuple of float
            Physical range ``(low, high)``, divided into equal steps by the codes; by default the output has the range
            of the input. A range with ``low == -high`` has signed codes, any other unsigned codes. Results outside the
            range are limited to it.
        unit : str
            Unit of the input and the output, at most 16 characters.
        max_error : float or "faithful"
            Largest allowed difference from the exact result, for all inputs in range, in `unit`; more than half an LSB
            of the output. "faithful" means one LSB.
        realization, architecture : str
            As the keys in ``[hardware]``; "auto" chooses the smallest.
        clock : float
            Clock frequency of the hardware in Hz, at least `sample_rate`.

        Raises
        ------
        SpecificationError
            If a value is invalid.

        Examples
        --------
        >>> import scipy.signal, sosmith
        >>> sos = scipy.signal.butter(2, 1000, fs=48000, output="sos")
        >>> spec = sosmith.Specification.from_sos(sos, sample_rate=48000, name="bass", output_bits=12)
        >>> print(spec.toml().replace(str(sos[0].tolist()), "[...]"))
        name = "bass"
        sample_rate = 48000.0
        channels = 1
        <BLANKLINE>
        [input.x]
        bits = 16
        range = [-1.0, 1.0]
        signed = true
        <BLANKLINE>
        [filter]
        sos = [[...]]
        <BLANKLINE>
        [output]
        bits = 12
        range = [-1.0, 1.0]
        signed = true
        unit = ""
        max_error = "faithful"
        <BLANKLINE>
        [hardware]
        realization = "auto"
        architecture = "auto"
        clock = 12000000.0
        <BLANKLINE>
        """
        from sosmith.interface.arrays import real_numbers  # numpy, which a specification from a file does without

        real_numbers(sos, "sos")  # which may be decimals of more digits

        return cls.load(
            {
                "name": name,
                "sample_rate": _float(sample_rate, "sample_rate"),
                "channels": channels,
                "input": {"x": _format(input_bits, input_range)},
                "filter": {"sos": sos},
                "output": _format(output_bits or input_bits, output_range or input_range)
                | {"unit": unit, "max_error": max_error},
                "hardware": {"realization": realization, "architecture": architecture, "clock": _float(clock, "clock")},
            }
        )

    @classmethod
    def from_taps(
        cls, taps: npt.ArrayLike, sample_rate: float, *, name: str = "fir_filter", **keys: Any
    ) -> Specification:
        """Specify hardware for an FIR filter with given taps, such as those from scipy.

        Parameters
        ----------
        taps : array_like, shape (taps,)
            1 to 512 coefficients of 1, 1/z, 1/z^2 and so on, not all 0, as returned by ``scipy.signal.remez``. Taps of
            one magnitude share a multiplier, taps of 0 have none.
        sample_rate : float
            Samples per second of each channel, in Hz.
        name : str
            Name of the top module and of the files, a Verilog identifier.
        **keys
            The others of `from_sos`: `channels`, `input_bits`, `input_range`, `output_bits`, `output_range`, `unit`,
            `max_error`, `realization`, `architecture`, `clock`.

        Raises
        ------
        SpecificationError
            If a value is invalid.

        Examples
        --------
        >>> import sosmith
        >>> spec = sosmith.Specification.from_taps([0.25, 0.5, 0.25], sample_rate=1000, name="mean")
        >>> spec.as_dict()["filter"]
        {'taps': [0.25, 0.5, 0.25]}
        """
        # The sections stand for the taps while everything else is checked.
        return cls.from_sos([[1, 0, 0, 1, 0, 0]], sample_rate, name=name, **keys).replaced(filter={"taps": taps})

    @classmethod
    def example(cls) -> Specification:
        """Return the built-in example, the flange wear of a locomotive, as written by `sosmith init`."""
        import tomllib

        return cls(from_tree(tomllib.loads(example(), parse_float=Decimal), _UNNAMED))

    def replaced(self, **keys: Any) -> Specification:
        """Return a copy with other values for some of the top-level keys; None removes a key.

        A table replaces the whole previous table.

        Examples
        --------
        >>> import sosmith
        >>> spec = sosmith.Specification.example().replaced(hardware={"architecture": "serial"})
        >>> spec.as_dict()["hardware"]
        {'architecture': 'serial'}
        """
        tree = {key: value for key, value in (self.as_dict() | keys).items() if value is not None}
        return type(self)(from_tree(exact(tree), self.checked.path))

    @staticmethod
    def choices() -> dict[str, tuple[str, ...]]:
        """Return the valid names of each key that takes one of several, by the path of the key.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.Specification.choices()["filter.kind"]
        ('lowpass', 'highpass', 'bandpass', 'bandstop')
        """
        return {
            "filter.family": (*FAMILIES, *FIR_FAMILIES),
            "filter.kind": KINDS,
            "filter.method": METHODS,
            "filter.freedom": FREEDOMS,
            "hardware.realization": REALIZATIONS,
            "hardware.architecture": ARCHITECTURES,
            "hardware.start": STARTS,
        }

    @staticmethod
    def combinations() -> tuple[Combination, ...]:
        """Return whether each two things that a specification can ask of the hardware go together.

        Of an architecture and an option, then of two options: `row` and `option` name them, `verdict` is "ok", "no
        use", "refused" for a reason of principle or "not yet", and `reason` says why, or is empty.

        Examples
        --------
        >>> import sosmith
        >>> one = sosmith.Specification.combinations()[0]
        >>> one.row, one.option, one.verdict
        ('parallel', 'FIR', 'ok')
        """
        return combinations()

    @staticmethod
    def losses(family: str) -> tuple[str, ...]:
        """Return the keys of the losses that a family of filters needs beside order and cutoff.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.Specification.losses("elliptic"), sosmith.Specification.losses("bessel")
        (('passband_loss', 'stopband_loss'), ())
        """
        return LOSSES.get(family, ())

    @property
    def realizations(self) -> tuple[str, ...]:
        """Names of the realizations that there are for a filter of this kind.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.Specification.from_taps([0.5, 0.5], 1000).realizations
        ('fir_direct', 'fir_symmetric', 'fir_transposed')
        """
        from sosmith.gen.realizations.registry import realizations_for

        return tuple(realizations_for(fir=self.checked.filter.is_fir))

    @property
    def filter(self) -> Filter:
        """The ideal filter, without any rounding; takes milliseconds, with `freedom` seconds.

        Raises
        ------
        ShortfallError
            If there is no such filter, for instance because no order meets the edges.
        """
        from sosmith.gen.core import filter_of
        from sosmith.interface.filter import Filter

        return Filter(filter_of(self.checked))

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.checked.name

    @property
    def sample_rate(self) -> float:
        """Samples per second of each channel, in Hz."""
        return float(self.checked.sample_rate)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.checked.channels

    @property
    def inputs(self) -> dict[str, str]:
        """Unit of each input by its name, in the order of the fields in the hardware."""
        return {port.name: port.unit for port in self.checked.inputs}

    @property
    def max_error(self) -> Quantity:
        """Largest allowed difference between hardware and exact result, in the unit of the output."""
        return Quantity(float(self.checked.max_error), self.checked.output.unit)

    def as_dict(self) -> dict[str, Any]:
        """Return the keys as given, in JSON types; `load` accepts them."""
        return _plain(self.checked.source)

    def toml(self) -> str:
        """Return the specification as the text of a TOML file, its own if it has one; `load` reads back the same."""
        return self.checked.text

    def tables(self) -> list[Table]:
        """Return the keys as given, with dots, and their values."""
        from sosmith.gen.report.comparison.differences import flat_keys  # and with it numpy

        rows = list(flat_keys(self.as_dict()).items())
        return [Table(f"Specification {self.name}", rows, ("key", "value"))]

    def __repr__(self) -> str:
        rate = f"{self.sample_rate:g} Hz"
        return f"<sosmith.Specification {self.name}: {', '.join(self.inputs)} -> {self.checked.output.name} at {rate}>"


def specification_of(source: Specification | str | PathLike[str] | Mapping[str, Any]) -> Specification:
    """Return `source` itself if it is a specification, otherwise load it with `Specification.load`."""
    return source if isinstance(source, Specification) else Specification.load(source)


def path_of(source: str | PathLike[str], what: str) -> str:
    """Return a path as text; `what` begins the sentence that refuses other things."""
    try:
        return fspath(source)
    except TypeError:
        raise SpecificationError(f"{what}, not {_kind(source)}") from None


def _kind(value: object) -> str:
    plain = value is None or isinstance(value, int | float)
    return repr(value) if plain else f"something of type {type(value).__name__}"


def _float(value: float, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise SpecificationError(f"{name} must be a number of Hz, not {value!r}") from None


def _format(bits: int, ends: Sequence[float]) -> dict[str, Any]:
    try:
        low, high = map(float, ends)
    except (TypeError, ValueError, OverflowError):
        raise SpecificationError(f"a range must be two numbers, (low, high), not {ends!r}") from None
    return {"bits": bits, "range": [low, high], "signed": low == -high}


def _plain(tree: dict[str, Any]) -> dict[str, Any]:
    """Copy nested tables, so that changes by the caller have no effect here."""
    return {key: _plain(value) if isinstance(value, dict) else value for key, value in tree.items()}
