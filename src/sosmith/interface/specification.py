"""What is asked for: a specification from a TOML file, from a dict, or around second-order sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from numbers import Integral, Real
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sosmith.gen.specification.specification import Specification as Checked
from sosmith.gen.specification.specification import example, from_tree, load
from sosmith.gen.specification.toml_text import toml_text
from sosmith.interface.quantity import Quantity
from sosmith.model.errors import SpecificationError

if TYPE_CHECKING:
    import numpy.typing as npt

_UNNAMED = Path("specification")
"""What messages call a specification that comes from no file."""


@dataclass(frozen=True)
class Specification:
    """A checked specification; make one with `load`, `from_sos` or `example`.

    It is checked as a whole when it is made, and never changes. The keys are those of the TOML file: `sosmith init`
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
    """The same with every number as an exact `fractions.Fraction`, as the rooms below take it."""

    @classmethod
    def load(cls, source: str | PathLike[str] | Mapping[str, Any]) -> Specification:
        """Read and check a TOML file, or a dict with the same keys.

        Parameters
        ----------
        source : path or mapping
            Path of the file; or its content, where a float counts as the shortest decimal number that reads back as
            the same float, and arrays of numpy count as lists.

        Raises
        ------
        SpecificationError
            For the first thing that is wrong, with the path of its key, what would be right and what was found.
        """
        if isinstance(source, Mapping):
            return cls(from_tree(_exact(source), _UNNAMED))
        return cls(load(Path(fspath(source))))

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
        """Ask for hardware that computes given second-order sections, such as those of scipy.

        Parameters
        ----------
        sos : array_like, shape (sections, 6)
            1 to 10 stable rows ``[b0, b1, b2, 1, a1, a2]``, as ``scipy.signal.butter(..., output="sos")`` gives them.
        sample_rate : float
            Samples per second of each channel, in Hz.
        name : str
            Name of the top module and of the files, a Verilog identifier.
        channels : int
            Number of channels that share the hardware, 1 to 65536.
        input_bits, output_bits : int
            Bits of a code, 2 to 32; the output has as many as the input unless it is told otherwise.
        input_range, output_range : tuple of float
            Physical values ``(low, high)`` that the codes divide into equal steps; the output takes the range of the
            input unless it is told otherwise. A range with ``low == -high`` has signed codes, any other unsigned ones.
            A result outside of the range is limited to it.
        unit : str
            Unit of input and output, at most 16 characters.
        max_error : float or "faithful"
            Largest allowed difference to the exact result, for all inputs in range, in `unit`; more than half a step
            of the output. "faithful" stands for one step.
        realization, architecture : str
            As the keys of ``[hardware]``; "auto" takes what is smallest.
        clock : float
            Clock of the hardware in Hz, at least `sample_rate`.

        Raises
        ------
        SpecificationError
            If a value is none of these.

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
        return cls.load(
            {
                "name": name,
                "sample_rate": float(sample_rate),
                "channels": channels,
                "input": {"x": _format(input_bits, input_range)},
                "filter": {"sos": sos},
                "output": _format(output_bits or input_bits, output_range or input_range)
                | {"unit": unit, "max_error": max_error},
                "hardware": {"realization": realization, "architecture": architecture, "clock": float(clock)},
            }
        )

    @classmethod
    def example(cls) -> Specification:
        """Return the built-in example, the flange wear of a locomotive: what `sosmith init` writes."""
        import tomllib

        return cls(from_tree(tomllib.loads(example(), parse_float=Decimal), _UNNAMED))

    def replaced(self, **keys: Any) -> Specification:
        """Return the specification with other values for some of its top-level keys; None leaves a key out.

        A table takes the place of the whole table that was there.

        Examples
        --------
        >>> import sosmith
        >>> spec = sosmith.Specification.example().replaced(hardware={"architecture": "serial"})
        >>> spec.as_dict()["hardware"]
        {'architecture': 'serial'}
        """
        tree = {key: value for key, value in (self.as_dict() | keys).items() if value is not None}
        return type(self)(from_tree(_exact(tree), self.checked.path))

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
        """Unit of each input, by its name, in the order of the hardware's fields."""
        return {port.name: port.unit for port in self.checked.inputs}

    @property
    def max_error(self) -> Quantity:
        """Largest allowed difference between hardware and exact result, in the unit of the output."""
        return Quantity(float(self.checked.max_error), self.checked.output.unit)

    def as_dict(self) -> dict[str, Any]:
        """Return the keys as they were given, in the types of JSON; `load` takes them again."""
        return _plain(self.checked.source)

    def toml(self) -> str:
        """Return the specification as the text of a TOML file; `load` reads the same from it."""
        return toml_text(self.checked.source)

    def __repr__(self) -> str:
        rate = f"{self.sample_rate:g} Hz"
        return f"<sosmith.Specification {self.name}: {', '.join(self.inputs)} -> {self.checked.output.name} at {rate}>"


def specification_of(source: Specification | str | PathLike[str] | Mapping[str, Any]) -> Specification:
    """Return `source` itself if it is a specification, else what `Specification.load` makes of it."""
    return source if isinstance(source, Specification) else Specification.load(source)


def _format(bits: int, ends: Sequence[float]) -> dict[str, Any]:
    if len(ends) != 2:
        raise SpecificationError(f"a range must be two numbers, (low, high), not {len(ends)}")
    low, high = map(float, ends)
    return {"bits": bits, "range": [low, high], "signed": low == -high}


def _plain(tree: dict[str, Any]) -> dict[str, Any]:
    """Copy nested tables, so that whoever changes them changes nothing here."""
    return {key: _plain(value) if isinstance(value, dict) else value for key, value in tree.items()}


def _exact(value: Any) -> Any:
    """Return nested values as `tomllib` gives them, with every float as the `Decimal` that it is written as."""
    if isinstance(value, Mapping):
        return {str(key): _exact(item) for key, item in value.items()}
    if isinstance(value, str | bool | Decimal):
        return value
    if hasattr(value, "tolist"):  # an array or a number of numpy
        return _exact(value.tolist())
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return Decimal(repr(float(value)))
    if isinstance(value, Sequence):
        return [_exact(item) for item in value]
    return value
