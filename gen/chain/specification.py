"""The specification of a chain: what is common to all of it, and its stages in order.

Each stage is an ordinary specification, which `StageSpec.ordinary` writes as soon as its ports are known. So every rule
about a filter is that of a filter alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Context, Decimal, Inexact
from fractions import Fraction
from math import prod
from typing import Any

from sosmith.gen.chain.automatic.limits import Limits
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.specification import Specification, from_tree
from sosmith.gen.specification.values import literal
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port

_OF_ALL = ("architecture", "multipliers", "protect", "reload", "reload_lock", "start", "keep")
"""Keys of ``[hardware]`` that hold for all stages; the realization of one filter is none of another."""

REMEMBERS_INPUTS = "fir_direct"
"""Realization of the cores of a stage whose taps can be loaded, if none is asked for: states are past inputs, so that
no result mixes old taps and new ones."""

_EXACT = Context(prec=200, traps=[Inexact])

ANY_INPUT, ANY_OUTPUT = (
    Port.from_range(name, 16, Fraction(-1), Fraction(1), signed=True, unit="") for name in ("x", "y")
)
"""Ports of a stage whose ports are not known yet."""


@dataclass(frozen=True, kw_only=True)
class StageSpec:
    """A stage of a chain.

    Attributes
    ----------
    name : str
        Name of the stage; that of its core has the name of the chain before it.
    kind : str
        One of `sosmith.gen.chain.reading.KINDS`.
    tables : mapping of str
        ``[filter]``, and ``[calibration]`` of a polynomial, as `tomllib` gives them.
    hardware : mapping of str
        What the stage says of its hardware.
    factor : int
        By how much it decimates; 1 if all results leave.
    rise : int
        By how much it interpolates; 1 if each sample has one result.
    rate : Fraction
        Of the samples that it takes, in Hz.
    edge : Fraction or None
        Upper edge of its pass band, in Hz, if it is a low-pass filter that states one.
    """

    name: str
    kind: str
    tables: Mapping[str, Any]
    hardware: Mapping[str, Any]
    factor: int
    rise: int
    rate: Fraction
    edge: Fraction | None

    @property
    def filter_rate(self) -> Fraction:
        """Rate at which its filter is described, in Hz: that of its samples, or of its results if it interpolates."""
        return self.rate * self.rise

    @property
    def keeps_taps(self) -> bool:
        """Whether taps are given, or a file of them; others, in a stage that interpolates, are times `rise`."""
        return self.kind != "cic" and not {"taps", "taps_file"}.isdisjoint(self.tables["filter"])

    @property
    def core(self) -> str:
        """The core of its ordinary specification, one of `sosmith.gen.specification.choices.CORES`."""
        return "calibration" if self.kind == "polynomial" else "filter"

    @property
    def needs_powers_of_two(self) -> bool:
        """Whether its steps in and out must differ by a power of two: those of an FIR filter that decimates."""
        return self.factor > 1 and self.kind != "iir"

    def ordinary(
        self, chain: ChainSpec, inputs: tuple[Port, ...], output: Port, max_error: Fraction | None = None
    ) -> Specification:
        """Return the stage by itself, between ports; without `max_error` it may take one LSB of the output.

        Of a stage that interpolates, it is the filter behind the zeros that are put between samples.

        Raises
        ------
        SpecificationError
            If the stage breaks a rule.
        """
        return self._alone(chain, self.tables, self.filter_rate, self.name, inputs, output, max_error)

    def phase(
        self,
        chain: ChainSpec,
        k: int,
        taps: Sequence[Fraction],
        inputs: tuple[Port, ...],
        output: Port,
        max_error: Fraction,
    ) -> Specification:
        """Return the filter of phase k of a stage that interpolates, by its taps; the rest is as for `ordinary`."""
        if endless := [tap for tap in taps if not is_decimal(tap)]:
            raise SpecificationError(
                f"{chain.base.path}: stage {self.name}: taps must be finite decimals, as those of each phase are "
                f"written out, not {literal(endless[0])}"
            )
        tables = {"filter": {"taps": [decimal(tap) for tap in taps]}}
        return self._alone(chain, tables, self.rate, f"{self.name}_p{k}", inputs, output, max_error, of_several=True)

    def locks(self, chain: ChainSpec) -> bool:
        """Whether loading its coefficients can be locked."""
        return bool(self.hardware.get("reload_lock", chain.base.hardware.reload_lock))

    def _alone(
        self,
        chain: ChainSpec,
        tables: Mapping[str, Any],
        rate: Fraction,
        name: str,
        inputs: tuple[Port, ...],
        output: Port,
        max_error: Fraction | None,
        *,
        of_several: bool = False,
    ) -> Specification:
        common = chain.base.source.get("hardware", {})
        hardware = {key: common[key] for key in _OF_ALL if key in common} | dict(self.hardware)
        if of_several and hardware.get("reload"):  # the registers are those of all cores of the stage
            hardware = {key: value for key, value in hardware.items() if key != "reload_lock"}
            hardware |= {"reload_registers": False, "realization": hardware.get("realization", REMEMBERS_INPUTS)}
        tree: dict[str, Any] = {
            "name": f"{chain.name}_{name}",
            "sample_rate": decimal(rate),
            "channels": chain.base.channels,
            "input": {port.name: _format(port) for port in inputs},
            **tables,
            "output": _format(output)
            | {"unit": output.unit}
            | ({} if max_error is None else {"max_error": decimal(max_error)}),
            "hardware": {"clock": decimal(chain.base.hardware.clock)} | hardware,
        }
        return from_tree(tree, chain.base.path.parent / f"{chain.base.path.name}: stage {name}")


@dataclass(frozen=True, kw_only=True)
class ChainSpec:
    """A checked specification of a chain.

    Attributes
    ----------
    base : Specification
        What is common: name, rate, channels, ports, allowed error and hardware. Its filter is a wire.
    source : dict
        The file as read, in the types of JSON.
    text : str
        TOML.
    stages : tuple of StageSpec
        In the order of the samples.
    limits : Limits or None
        What is asked of the whole, or of some stages.
    span : tuple of int or None
        Number of the first of these, and of the one behind the last; None for all.
    is_written : bool
        Whether the stages were chosen for one of the kind auto, so that nobody has the text yet.
    tree : mapping
        The file as read, with every float as a decimal number.
    """

    base: Specification
    source: dict[str, Any]
    text: str
    stages: tuple[StageSpec, ...]
    limits: Limits | None = None
    span: tuple[int, int] | None = None
    is_written: bool = False
    tree: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def is_automatic(self) -> bool:
        """Whether the stages have to be chosen first, for the one of the kind auto."""
        return any(stage.kind == AUTO for stage in self.stages)

    @property
    def is_steady(self) -> bool:
        """Whether each stage starts as if its first sample had been there for ever."""
        return self.base.hardware.start == "steady"

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.base.name

    @property
    def factor(self) -> int:
        """By how much all stages together decimate: samples of a channel for each result, if none interpolates."""
        return prod(stage.factor for stage in self.stages)

    @property
    def rise(self) -> int:
        """By how much all stages together interpolate: results for each sample, if none decimates."""
        return prod(stage.rise for stage in self.stages)

    @property
    def last_rate(self) -> Fraction:
        """Results of a channel a second."""
        return self.base.sample_rate * self.rise / self.factor

    @property
    def edge(self) -> Fraction | None:
        """Upper edge of the pass band, in Hz: that of limits of all stages, or the lowest of one; None without one."""
        if self.limits is not None and self.span is None:
            return self.limits.passband_edge
        return min((stage.edge for stage in self.stages if stage.edge is not None), default=None)


def decimal(value: Fraction) -> Decimal:
    """Return a number as a decimal, exactly.

    Raises
    ------
    Inexact
        If its digits never end.
    """
    return _EXACT.divide(Decimal(value.numerator), Decimal(value.denominator))


def is_decimal(value: Fraction) -> bool:
    """Say whether the digits of a number end."""
    try:
        decimal(value)
    except Inexact:
        return False
    return True


def _format(port: Port) -> dict[str, Any]:
    low = port.zero + port.lsb * port.lowest
    high = low + port.lsb * 2**port.bits
    return {"bits": port.bits, "range": [decimal(low), decimal(high)], "signed": port.signed}
