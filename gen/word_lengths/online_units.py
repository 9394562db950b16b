"""Size of a datapath whose sections work in on-line arithmetic: units of the sections, and the words beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.gen.specification.choices import ERROR_FEEDBACK
from sosmith.gen.specification.values import listed
from sosmith.gen.word_lengths.cost import Cost, area_of, cost_of_graphs
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Graph, Op
from sosmith.model.errors import ShortfallError
from sosmith.model.sections.online import (
    LOOP_CLOCKS,
    OnlineError,
    OnlineSchedule,
    OnlineSection,
    online_schedule,
    online_section,
    sections_of,
)

_DIGIT_BITS = 2

_CLOCKS = LOOP_CLOCKS + 4
"""Interval of most cascades, by which the area beside the sections counts."""


@dataclass(frozen=True)
class OnlineUnits:
    """Estimated area of the on-line architecture for its rate: LUT4 of the units that a section needs, times clocks.

    By area alone, a section whose samples come less often would be the better one, because fewer of them overlap.
    """

    best = "the smallest estimated area for its rate"
    beyond = "more"
    unsuited = "no direct form"
    negligible = 0.0
    hopeless = 2.5  # as for the parallel architecture
    few_digits = False
    floors_products = False
    exact_taps = False
    tied = False
    factor_bits = None

    def of_graph(self, graph: Graph) -> float:
        """Estimate the area of one stage, with as many units as the digits of its results take, times its interval."""
        try:
            section = online_section("", graph)
        except OnlineError:
            multiplies = any(node.op is Op.SCALE for node in graph.nodes)
            return math.inf if graph.delays and multiplies else area_of(graph) * _CLOCKS
        interval = section.delay + LOOP_CLOCKS
        units = (section.digits + section.delay) / interval
        return (units * unit_bits(section) + shared_bits(section)) * interval

    def of_datapath(self, datapath: Datapath) -> float:
        """Return the area of a whole design, in LUT4, times the clocks that a sample takes."""
        try:
            return online_cost(datapath).luts * online_schedule(datapath, 0).interval
        except OnlineError:
            return math.inf

    def least(self, graphs: Sequence[Graph]) -> float:
        """Return 0 if all are sections in direct form.

        Raises
        ------
        ShortfallError
            If one is not.
        """
        for number, graph in enumerate(graphs):
            try:
                online_section(f"section{number}", graph)
            except OnlineError as error:
                raise ShortfallError(unsuitable_online(error)) from None
        return 0

    def size_text(self, datapath: Datapath) -> str:
        """Return the product of area and clocks in words, and what it is made of."""
        schedule, luts = online_schedule(datapath, 0), online_cost(datapath).luts
        return (
            f"{luts * schedule.interval:,} LUT4 times clocks, from {luts:,} LUT4 in {schedule.units} units a section "
            f"and {schedule.interval} clocks a sample"
        )


def unsuitable_online(error: OnlineError) -> str:
    """Return the sentence for a datapath that has no on-line form."""
    return (
        f"the sections must suit the online architecture, as recursive ones in {listed(ERROR_FEEDBACK)} do: {error}; "
        "parallel takes every realization"
    )


def unit_bits(section: OnlineSection) -> int:
    """Adder bits of a unit: two tables, two adders, sum and carry of the residual, and what is fed back."""
    bits = section.residual_bits
    terms = len(section.numerator) + len(section.recursion) - 1
    tables = -(-terms // 2)
    return bits * (tables + (tables > 1) + 3) + len(section.feedback) * section.error_frac


def shared_bits(section: OnlineSection) -> int:
    """Adder bits of what the units of a section share: the exact residual before the last digit."""
    return section.error_frac * (1 + len(section.feedback))


def online_cost(datapath: Datapath) -> Cost:
    """Count the operators of the on-line architecture, before synthesis.

    Raises
    ------
    OnlineError
        If a section is not one for on-line arithmetic.
    """
    schedule = online_schedule(datapath, 0)
    numbers = sections_of(datapath)
    words = cost_of_graphs([stage.graph for k, stage in enumerate(datapath.stages) if k not in numbers])
    output = datapath.stages[numbers.stop - 1].graph.output_ranges[0]
    width = max(output.high.bit_length(), (-output.low).bit_length()) + 1
    adders = sum(schedule.units * unit_bits(s) + shared_bits(s) for s in schedule.sections)
    registers = sum(schedule.units * _unit_registers(s, schedule) for s in schedule.sections)
    return Cost(
        multiplications=words.multiplications,
        adder_bits=words.adder_bits + adders + 2 * schedule.units * width,
        register_bits=words.register_bits + registers + 2 * schedule.units * width,
    )


def _unit_registers(section: OnlineSection, schedule: OnlineSchedule) -> int:
    """Count the registers of a unit: two words, the carry-save pair, and the digits of earlier samples."""
    lines = len(section.recursion) * schedule.interval
    return 4 * section.residual_bits + _DIGIT_BITS * lines
