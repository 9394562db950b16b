"""The exact response of a stage, and the specifications of its cores: one, or one for each result of a sample."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from sosmith.gen.chain.response import Part, cic
from sosmith.gen.chain.specification import ANY_INPUT, ANY_OUTPUT, ChainSpec, StageSpec
from sosmith.gen.core import response_of
from sosmith.gen.filter.exact_form import Exact
from sosmith.gen.specification.specification import Specification
from sosmith.gen.word_lengths.selection import Progress
from sosmith.model.errors import SpecificationError
from sosmith.model.port import Port


def exact_parts(chain: ChainSpec, stage: StageSpec, progress: Progress = lambda step: None) -> tuple[Part, ...]:
    """Return the exact response of a stage, which hardly depends on its ports; nothing of a polynomial.

    Raises
    ------
    SpecificationError
        If a phase of it has no tap.
    """
    if stage.kind == "polynomial":
        return ()
    spec = stage.ordinary(chain, (ANY_INPUT,), ANY_OUTPUT)
    response, _ = response_of(spec, "filter", progress)
    assert response.ideal is not None
    sections, pre_stage = response.ideal.exact, response.pre_stage
    if stage.rise > 1:
        return (Part((_between(chain, stage, sections),), 1, stage.rise),)
    if pre_stage is None:
        return (Part(sections, response.factor),)
    return cic(pre_stage.decimator.factor, pre_stage.decimator.stages), Part(sections)


def specs_of(
    chain: ChainSpec,
    stage: StageSpec,
    inputs: tuple[Port, ...],
    output: Port,
    allowed: Fraction,
    parts: Sequence[Part],
) -> list[Specification]:
    """Return the specifications of a stage's cores between ports; `parts` are those of `exact_parts`.

    Raises
    ------
    SpecificationError
        If the stage breaks a rule.
    """
    ordinary = stage.ordinary(chain, inputs, output, allowed)
    if stage.rise == 1:
        return [ordinary]
    taps = (ordinary.filter.taps if stage.keeps_taps else None) or parts[0].sections[0][0]
    return [
        stage.phase(chain, phase, taps[phase :: stage.rise], inputs, output, allowed) for phase in range(stage.rise)
    ]


def _between(chain: ChainSpec, stage: StageSpec, sections: Sequence[Exact]) -> Exact:
    """Return the filter that fills in between samples: as given, or with the gain of the stage restored.

    Raises
    ------
    SpecificationError
        If a phase of it has no tap.
    """
    ((taps, under),) = sections
    if not stage.keeps_taps:
        taps = tuple(tap * stage.rise for tap in taps)
    for phase in range(stage.rise):
        if not any(taps[phase :: stage.rise]):
            raise SpecificationError(
                f"{chain.base.path}: stage {stage.name}: taps {phase}, {phase + stage.rise}, .. must not all "
                f"be 0, as one result in {stage.rise} would be"
            )
    return taps, under
