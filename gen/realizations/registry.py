"""The registry of realizations: how a section of the ideal filter becomes an integer stage.

Each realization is registered once, here; its terms stand in `sosmith.gen.specification.realizations`. Word lengths,
proof, C model, hardware, report and test matrix follow. What makes its stages is loaded when a first one is made: most
designs come to direct forms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from sosmith.gen.realizations.direct_form import direct_form
from sosmith.gen.realizations.fir import fir_section
from sosmith.gen.realizations.section_format import WIDE, SectionFormat
from sosmith.gen.specification import choices
from sosmith.gen.specification import realizations as terms
from sosmith.gen.specification.realizations import RealizationTerms
from sosmith.model.dataflow.structure import Stage
from sosmith.model.sections.fir import Form

if TYPE_CHECKING:
    from sosmith.gen.realizations.lattice import Part

Row = Sequence[float]
"""b0, b1, b2, 1, a1, a2 of an ideal section; longer halves of an FIR filter, whose second one is 1, 0, 0, ..."""


class Section(Stage, Protocol):
    """A stage with coefficients; one in direct form has `error_feedback` too, as in `DirectForm1`."""

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
    terms : RealizationTerms
        Its name, and what is said of it.
    build : callable
        Makes the stage for a part, given its formats and name.
    parts : callable
        Turns the ideal sections into one part for each stage: the rows themselves for a cascade. Raises
        ShortfallError if the filter has no such realization.
    cascade : bool
        Whether every stage is one of several ideal sections, in any order.
    transfer : callable or None
        Returns numerator and denominator of a part, in rising powers of 1/z; None for rows, and where the word lengths
        of a filter that is no cascade are not searched.
    keeps_samples : bool
        Whether what it remembers are samples of the input, all of them, as an FIR filter can.
    not_decimated : str
        Why a filter that corrects a decimator's droop is not made so, half a sentence; empty if it is.
    """

    terms: RealizationTerms
    build: Callable[[Any, SectionFormat, str], Section]
    parts: Callable[[Sequence[Row]], Sequence[Any]] = tuple
    cascade: bool = True
    transfer: Callable[[Any], tuple[Sequence[Any], Sequence[Any]]] | None = None
    keeps_samples: bool = False
    not_decimated: str = ""

    @property
    def name(self) -> str:
        """As in the specification."""
        return self.terms.name

    @property
    def searched(self) -> bool:
        """Whether the word lengths of all stages are searched together."""
        return self.cascade or self.transfer is not None


@dataclass(frozen=True)
class _Late:
    """A function of another module of this folder, which is loaded when it is called."""

    module: str
    function: str

    def __call__(self, *values: Any, **options: Any) -> Any:
        module = import_module(f"sosmith.gen.realizations.{self.module}")
        return getattr(module, self.function)(*values, **options)


_LATTICE_STAGE = _Late("lattice", "lattice_stage")
_STATE_SPACE = _Late("state_space", "state_space")
_TRANSPOSED = _Late("transposed", "transposed_form")


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
    stage: Section = _LATTICE_STAGE(
        part,
        name=name,
        rounding=form.rounding,
        entries=(form.x, *form.beside),
        fracs=form.fracs,
        ranges=form.ranges,
        wide=(-WIDE, WIDE),
    )
    return stage


SECTIONS: dict[str, Realization] = {
    realization.name: realization
    for realization in (
        *(
            Realization(terms=each, build=_section(direct_form, feedback_order=each.feedback_order))
            for each in (terms.DF1, terms.DF1_EF1, terms.DF1_EF2)
        ),
        Realization(terms=terms.DF2T, build=_section(_TRANSPOSED, delta=False)),
        Realization(terms=terms.DELTA, build=_section(_TRANSPOSED, delta=True)),
        Realization(
            terms=terms.STATE_SPACE,
            build=_section(_STATE_SPACE, design=_Late("state_space", "minimum_noise"), truncating=False),
        ),
        Realization(
            terms=terms.NORMAL,
            build=_section(_STATE_SPACE, design=_Late("state_space", "normal"), truncating=True),
        ),
        Realization(
            terms=terms.LATTICE_WDF,
            build=_lattice,
            parts=_Late("lattice", "lattice_parts"),
            cascade=False,
            not_decimated="with its droop corrected, the filter is no sum of two allpass filters",
        ),
    )
}
"""Realizations of second-order sections, by name, in the order in which lists show them."""

FIR: dict[str, Realization] = {
    each.name: Realization(
        terms=each,
        build=partial(fir_section, structure=form),
        cascade=False,
        keeps_samples=form is not Form.TRANSPOSED,
        not_decimated="filters behind a decimator have poles",
    )
    for each, form in zip(terms.FIR, Form, strict=True)
}
"""Realizations of FIR filters, likewise."""

REALIZATIONS = SECTIONS | FIR
"""All realizations that a specification can name, by name, in the order in which lists show them."""


def realizations_for(*, fir: bool) -> dict[str, Realization]:
    """Return the realizations of FIR filters, or those of second-order sections."""
    return FIR if fir else SECTIONS


LOOK_AHEAD: dict[int, Realization] = {
    samples: Realization(
        terms=RealizationTerms(
            f"look_ahead_{samples}",
            f"zeros in one FIR filter, recursions with scattered look-ahead over {samples} samples",
        ),
        build=_Late("look_ahead", "look_ahead"),
        parts=partial(_Late("look_ahead", "look_ahead_parts"), distance=samples),
        cascade=False,
        transfer=lambda part: part.transfer,
    )
    for samples in choices.LOOK_AHEAD
}
"""Realizations of pipelines with look-ahead, by the samples that their recursions go back at once."""


def realization_of(name: str) -> Realization:
    """Return the realization with a name, be it one that a specification can name or one with look-ahead."""
    others = {realization.name: realization for realization in LOOK_AHEAD.values()}
    return REALIZATIONS[name] if name in REALIZATIONS else others[name]


CASCADES = tuple(name for name, realization in SECTIONS.items() if realization.cascade)
"""Names of the realizations whose stages are the ideal sections."""

BEST_KEPT = terms.DF1_EF2.name
"""Realization that needs the fewest bits at low cutoffs: if it fails too, its reason is the most informative."""
