"""Specifications of chains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.gen.chain.reading import KINDS, chain_from_tree, is_chain, keys_of, load_chain
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT, ChainSpec
from sosmith.gen.facts.table import Table, View
from sosmith.gen.specification.choices import FAMILIES, FIR_FAMILIES
from sosmith.gen.specification.exact_values import exact
from sosmith.gen.specification.specification import parsed, text_of
from sosmith.interface.quantity import Quantity
from sosmith.interface.specification import Specification, path_of
from sosmith.model.errors import SpecificationError, falling_short

if TYPE_CHECKING:
    from sosmith.interface.chain.filter import ChainFilter


@dataclass(frozen=True)
class ChainSpecification(View):
    """A checked specification of a chain of stages; make one with `load`.

    Examples
    --------
    >>> import sosmith
    >>> spec = sosmith.ChainSpecification.load({
    ...     "name": "receiver",
    ...     "sample_rate": 64000,
    ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
    ...     "stage": [
    ...         {"name": "cic", "kind": "cic", "order": 3, "decimate": 8},
    ...         {"name": "channel", "kind": "fir", "taps": [0.25, 0.5, 0.25]},
    ...     ],
    ...     "output": {"bits": 16, "range": [-1.0, 1.0], "signed": True},
    ... })
    >>> spec, spec.factor
    (<sosmith.ChainSpecification receiver: cic -> channel, 64000 Hz to 8000 Hz>, 8)
    """

    checked: ChainSpec = field(repr=False)
    """The same specification with every number as an exact `fractions.Fraction`."""

    @classmethod
    def load(cls, source: str | PathLike[str] | Mapping[str, Any]) -> ChainSpecification:
        """Read and check a TOML file with tables ``[[stage]]``, or a dict with the same keys.

        Raises
        ------
        SpecificationError
            For all errors of the keys, with the path of each, what was expected and what was given.
        """
        if isinstance(source, Mapping):
            return cls(chain_from_tree(exact(source), Path("specification")))
        return cls(load_chain(Path(path_of(source, "the specification must be a path or a dict"))))

    @classmethod
    def from_toml(cls, text: str, path: str | PathLike[str] = Path("specification")) -> ChainSpecification:
        """Check the text of a TOML file, as `Specification.from_toml` does.

        Raises
        ------
        SpecificationError
            As `load`.
        """
        place = Path(fspath(path))
        return cls(chain_from_tree(parsed(text, place), place, text))

    @staticmethod
    def kinds() -> dict[str, tuple[str, ...]]:
        """Return the keys that a stage can have, by its kind.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.ChainSpecification.kinds()["gain"][:3]
        ('name', 'kind', 'factor')
        """
        return {kind: keys_of(kind) for kind in KINDS}

    @staticmethod
    def families(kind: str) -> tuple[str, ...]:
        """Return the families of filters that a stage of a kind takes.

        Examples
        --------
        >>> import sosmith
        >>> sosmith.ChainSpecification.families("fir")[0], sosmith.ChainSpecification.families("cic")
        ('equiripple', ())
        """
        return {"iir": FAMILIES, "fir": FIR_FAMILIES}.get(kind, ())

    @property
    def is_automatic(self) -> bool:
        """Whether the stages have yet to be chosen, by `design_chain`, for one of the kind auto."""
        return self.checked.is_automatic

    @property
    def alone(self) -> tuple[Specification, ...]:
        """Each stage by itself, as the specification of a core between ports of 16 bits: its filter, and its choices.

        The sample rate is that at which its filter is described: of its results, if it interpolates.
        """
        chain = self.checked
        return tuple(
            Specification(
                stage.ordinary(chain, chain.base.inputs if stage.kind == "polynomial" else (ANY_INPUT,), ANY_OUTPUT)
            )
            for stage in chain.stages
        )

    @property
    def filter(self) -> ChainFilter:
        """The ideal filters in series, without any rounding; takes milliseconds, with `freedom` seconds.

        Raises
        ------
        SpecificationError
            If the stages have yet to be chosen, or a filter needs an order that is too high.
        ShortfallError
            If there is no such filter.
        """
        from sosmith.gen.chain.ideal import ideal_chain
        from sosmith.interface.chain.filter import ChainFilter

        if self.is_automatic:
            raise SpecificationError(
                f"{self.checked.base.path}: the stages must be given for a response, or chosen first: the "
                "specification of a chain that is designed has them"
            )
        with falling_short(self.checked.base.path):
            return ChainFilter(ideal_chain(self.checked))

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.checked.name

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages, in the order of the samples."""
        return tuple(stage.name for stage in self.checked.stages)

    @property
    def factor(self) -> int:
        """By how much the stages decimate: input samples of a channel for each result, if none interpolates."""
        return self.checked.factor

    @property
    def rise(self) -> int:
        """By how much the stages interpolate: results for each input sample, if none decimates."""
        return self.checked.rise

    @property
    def sample_rate(self) -> float:
        """Samples per second of each channel, in Hz."""
        return float(self.checked.base.sample_rate)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.checked.base.channels

    @property
    def inputs(self) -> dict[str, str]:
        """Unit of each input by its name, in the order of the fields in the hardware."""
        return {port.name: port.unit for port in self.checked.base.inputs}

    @property
    def max_error(self) -> Quantity:
        """Largest allowed difference between hardware and exact result, in the unit of the output."""
        return Quantity(float(self.checked.base.max_error), self.checked.base.output.unit)

    def as_dict(self) -> dict[str, Any]:
        """Return the keys as given, in JSON types; `load` accepts them."""
        return dict(self.checked.source)

    def toml(self) -> str:
        """Return the specification as the text of a TOML file; `load` reads back the same."""
        return self.checked.text

    def tables(self) -> list[Table]:
        """Return the stages: name, kind, rate and factor."""
        rows = [
            (
                stage.name,
                f"{stage.kind}, {float(stage.rate):g} Hz, "
                + (f"{stage.rise} of 1" if stage.rise > 1 else f"1 of {stage.factor}"),
            )
            for stage in self.checked.stages
        ]
        return [Table(f"Chain {self.name}", rows, ("stage", "what it is"))]

    def __repr__(self) -> str:
        rate = self.sample_rate
        return (
            f"<sosmith.ChainSpecification {self.name}: {' -> '.join(self.stages)}, "
            f"{rate:g} Hz to {float(self.checked.last_rate):g} Hz>"
        )


def specification_in(source: str | PathLike[str]) -> Specification | ChainSpecification:
    """Read a specification file: that of a chain if it has tables ``[[stage]]``, or else that of a core.

    Raises
    ------
    SpecificationError
        As the `load` of either.
    """
    path = Path(path_of(source, "the specification must be a path"))
    if is_chain(parsed(text_of(path), path)):
        return ChainSpecification.load(source)
    return Specification.load(source)
