"""The registry of realizations: how a section of the ideal filter becomes a stage of integers.

A realization is named here once. Word lengths, proof, C model, hardware, report and test matrix take it from here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from sosmith.gen.realizations.coefficients import Rounding
from sosmith.gen.realizations.direct_form import direct_form
from sosmith.gen.realizations.lattice import Part, lattice_parts, lattice_stage
from sosmith.gen.realizations.state_space import StateDesign, minimum_noise, normal, state_space
from sosmith.gen.realizations.transposed import transposed_form
from sosmith.model.dataflow.datapath import Stage

Row = Sequence[float]
"""b0, b1, b2, 1, a1, a2 of an ideal section."""

WIDE = 1 << 256
"""Limit of a code whose range is not known yet; it never meets hardware."""


class Section(Stage, Protocol):
    """A stage with coefficients."""

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        ...

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes of which bits may be dropped without need."""
        ...


@dataclass(frozen=True, kw_only=True)
class SectionFormat:
    """Everything about a section's words.

    Attributes
    ----------
    x_frac, x_low, x_high : int
        Fraction bits and range of the input's code.
    beside : tuple of tuple of int
        The same of each further input.
    coefficient_bits : int
        Significant bits of each coefficient.
    coefficients : mapping of str to tuple of int
        Integer and fraction bits of the coefficients, by name, that take another value than the nearest.
    fracs : mapping of str to int
        Fraction bits kept by each quantizer, by the name of the node that it quantizes. Empty, they keep as many as
        the input has; else those that are missing keep all, because with none nothing was left there to drop.
    ranges : mapping of str to tuple of int
        Range of the code of every node whose range is stated, by its name; `WIDE` where missing.
    """

    x_frac: int = 0
    x_low: int = -WIDE
    x_high: int = WIDE
    beside: tuple[tuple[int, int, int], ...] = ()
    coefficient_bits: int
    coefficients: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    fracs: Mapping[str, int] = field(default_factory=dict)
    ranges: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    @property
    def rounding(self) -> Rounding:
        """How coefficients become integers."""
        return Rounding(self.coefficient_bits, self.coefficients)


@dataclass(frozen=True, kw_only=True)
class Realization:
    """One way to compute a filter.

    Attributes
    ----------
    name : str
        As in the specification.
    title : str
        A few words for people.
    build : callable
        Makes the stage of a part in given formats, with a given name.
    parts : callable
        Takes the ideal sections apart into what the stages are made from; the rows themselves for a cascade. Raises
        ShortfallError where the filter cannot be realized so.
    cascade : bool
        Whether every stage is one of the ideal sections, in whichever order.
    """

    name: str
    title: str
    build: Callable[[Any, SectionFormat, str], Section]
    parts: Callable[[Sequence[Row]], Sequence[Any]] = tuple
    cascade: bool = True


def _direct_form(order: int) -> Callable[[Row, SectionFormat, str], Section]:
    def build(row: Row, words: SectionFormat, name: str) -> Section:
        return direct_form(
            row,
            name=name,
            feedback_order=order,
            rounding=words.rounding,
            x=(words.x_frac, words.x_low, words.x_high),
            fracs=words.fracs,
            ranges=words.ranges,
            wide=(-WIDE, WIDE),
        )

    return build


def _transposed_form(*, delta: bool) -> Callable[[Row, SectionFormat, str], Section]:
    def build(row: Row, words: SectionFormat, name: str) -> Section:
        return transposed_form(
            row,
            name=name,
            delta=delta,
            rounding=words.rounding,
            x=(words.x_frac, words.x_low, words.x_high),
            fracs=words.fracs,
            ranges=words.ranges,
            wide=(-WIDE, WIDE),
        )

    return build


def _state_space(
    design: Callable[[Row], StateDesign], *, truncating: bool
) -> Callable[[Row, SectionFormat, str], Section]:
    def build(row: Row, words: SectionFormat, name: str) -> Section:
        return state_space(
            row,
            name=name,
            design=design,
            truncating=truncating,
            rounding=words.rounding,
            u=(words.x_frac, words.x_low, words.x_high),
            fracs=words.fracs,
            ranges=words.ranges,
            wide=(-WIDE, WIDE),
        )

    return build


def _lattice(part: Part, words: SectionFormat, name: str) -> Section:
    return lattice_stage(
        part,
        name=name,
        rounding=words.rounding,
        entries=((words.x_frac, words.x_low, words.x_high), *words.beside),
        fracs=words.fracs,
        ranges=words.ranges,
        wide=(-WIDE, WIDE),
    )


REALIZATIONS: dict[str, Realization] = {
    realization.name: realization
    for realization in (
        Realization(name="df1", title="direct form I", build=_direct_form(0)),
        Realization(name="df1_ef1", title="direct form I, first-order error feedback", build=_direct_form(1)),
        Realization(name="df1_ef2", title="direct form I, second-order error feedback", build=_direct_form(2)),
        Realization(name="df2t", title="transposed direct form II", build=_transposed_form(delta=False)),
        Realization(
            name="delta", title="transposed direct form II, delta operator", build=_transposed_form(delta=True)
        ),
        Realization(
            name="state_space",
            title="state space with minimum roundoff noise",
            build=_state_space(minimum_noise, truncating=False),
        ),
        Realization(
            name="normal",
            title="normal form with truncated magnitudes, free of limit cycles",
            build=_state_space(normal, truncating=True),
        ),
        Realization(
            name="lattice_wdf",
            title="lattice wave digital filter, free of limit cycles",
            build=_lattice,
            parts=lattice_parts,
            cascade=False,
        ),
    )
}
"""All realizations, by name, in the order in which lists show them."""

CASCADES = tuple(name for name, realization in REALIZATIONS.items() if realization.cascade)
"""Names of the realizations whose stages are the ideal sections."""

BEST_KEPT = "df1_ef2"
"""Realization whose rounding needs the fewest bits at low cutoffs: where it falls short, its reason tells most."""
