"""The registry of realizations: how a section of the ideal filter becomes an integer stage.

Each realization is registered once, here. Word lengths, proof, C model, hardware, report and test matrix follow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from sosmith.gen.realizations.direct_form import direct_form
from sosmith.gen.realizations.lattice import Part, lattice_parts, lattice_stage
from sosmith.gen.realizations.look_ahead import look_ahead
from sosmith.gen.realizations.section_format import WIDE, SectionFormat
from sosmith.gen.realizations.state_space import minimum_noise, normal, state_space
from sosmith.gen.realizations.transposed import transposed_form
from sosmith.gen.specification import choices
from sosmith.model.dataflow.datapath import Stage

Row = Sequence[float]
"""b0, b1, b2, 1, a1, a2 of an ideal section."""


class Section(Stage, Protocol):
    """A stage with coefficients."""

    @property
    def coefficients(self) -> dict[str, tuple[int, int]]:
        """Integer and fraction bits of every coefficient, by name."""
        ...

    @property
    def optional_quantizers(self) -> tuple[str, ...]:
        """Names of the nodes whose quantizers are optional."""
        ...

    @property
    def stated_fracs(self) -> dict[str, int]:
        """Fraction bits of the nodes with a stated range, by name."""
        ...


@dataclass(frozen=True, kw_only=True)
class Realization:
    """One way to compute a filter.

    Attributes
    ----------
    name : str
        As in the specification.
    title : str
        Short description.
    build : callable
        Makes the stage for a part, given its formats and name.
    parts : callable
        Turns the ideal sections into one part for each stage: the rows themselves for a cascade. Raises
        ShortfallError if the filter has no such realization.
    cascade : bool
        Whether every stage is one of the ideal sections, in any order.
    feedback_order : int or None
        Order of its error feedback, where that is all it differs in from others, so that they can be compared at the
        same word lengths; None otherwise.
    not_decimated : str
        Why a filter that corrects a decimator's droop is not made so, half a sentence; empty if it is.
    """

    name: str
    title: str
    build: Callable[[Any, SectionFormat, str], Section]
    parts: Callable[[Sequence[Row]], Sequence[Any]] = tuple
    cascade: bool = True
    feedback_order: int | None = None
    not_decimated: str = ""


def _section(make: Callable[..., Section], **options: Any) -> Callable[[Row, SectionFormat, str], Section]:
    """Return the builder of a section that takes one row, from what makes it and its options."""

    def build(row: Row, form: SectionFormat, name: str) -> Section:
        return make(
            row,
            name=name,
            rounding=form.rounding,
            x=form.x,
            fracs=form.fracs,
            ranges=form.ranges,
            wide=(-WIDE, WIDE),
            **options,
        )

    return build


def _lattice(part: Part, form: SectionFormat, name: str) -> Section:
    return lattice_stage(
        part,
        name=name,
        rounding=form.rounding,
        entries=(form.x, *form.beside),
        fracs=form.fracs,
        ranges=form.ranges,
        wide=(-WIDE, WIDE),
    )


def _with_error_feedback(name: str, title: str, order: int) -> Realization:
    build = _section(direct_form, feedback_order=order)
    return Realization(name=name, title=title, build=build, feedback_order=order)


REALIZATIONS: dict[str, Realization] = {
    realization.name: realization
    for realization in (
        _with_error_feedback("df1", "direct form I", 0),
        _with_error_feedback("df1_ef1", "direct form I, first-order error feedback", 1),
        _with_error_feedback("df1_ef2", "direct form I, second-order error feedback", 2),
        Realization(name="df2t", title="transposed direct form II", build=_section(transposed_form, delta=False)),
        Realization(
            name="delta", title="transposed direct form II, delta operator", build=_section(transposed_form, delta=True)
        ),
        Realization(
            name="state_space",
            title="state space with minimum roundoff noise",
            build=_section(state_space, design=minimum_noise, truncating=False),
        ),
        Realization(
            name="normal",
            title="normal form with truncated magnitudes, free of limit cycles",
            build=_section(state_space, design=normal, truncating=True),
        ),
        Realization(
            name="lattice_wdf",
            title="lattice wave digital filter, free of limit cycles",
            build=_lattice,
            parts=lattice_parts,
            cascade=False,
            not_decimated="with its droop corrected, the filter is no sum of two allpass filters",
        ),
    )
}
"""All realizations that a specification can name, by name, in the order in which lists show them."""

LOOK_AHEAD: dict[int, Realization] = {
    samples: Realization(
        name=f"look_ahead_{samples}",
        title=f"direct form with scattered look-ahead over {samples} samples",
        build=_section(look_ahead, doublings=samples.bit_length() - 1),
    )
    for samples in choices.LOOK_AHEAD
}
"""Realizations of pipelines with look-ahead, by the samples that their recursions go back at once."""


def realization_of(name: str) -> Realization:
    """Return the realization with a name, be it one that a specification can name or one with look-ahead."""
    others = {realization.name: realization for realization in LOOK_AHEAD.values()}
    return REALIZATIONS[name] if name in REALIZATIONS else others[name]


CASCADES = tuple(name for name, realization in REALIZATIONS.items() if realization.cascade)
"""Names of the realizations whose stages are the ideal sections."""

ERROR_FEEDBACK = tuple(name for name, realization in REALIZATIONS.items() if realization.feedback_order is not None)
"""Names of the realizations that differ only in their error feedback."""

BEST_KEPT = "df1_ef2"
"""Realization that needs the fewest bits at low cutoffs: if it fails too, its reason is the most informative."""
