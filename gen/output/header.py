"""Comments in the SystemVerilog: what the core is and how it is used, and above each stage what it computes.

::

    // name: what it is             one line for the reader who opens the file
    // licence, version, hash       where it comes from
    // bound, timing, ports         what it promises, and how it is connected
    // sections                     H(z) of each, with the integer coefficients

    // section0: y[n] = ...         the same above the module of a stage, in the parallel architecture
    module name_section0(...)
      // product_A1: Q13.22, ..     format and range of a node, above its net; above the module if it has none
      wire [35:0] product_A1;
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from textwrap import wrap

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.core_facts import CoreFacts, SectionFacts
from sosmith.gen.output.module_lines import module_lines
from sosmith.gen.output.pins import pins
from sosmith.gen.quantity import frequency
from sosmith.gen.version import __version__
from sosmith.model.templates import in_comment, render

_LINE = 112
"""Characters of a line, without the comment sign, for equations of many terms."""


def with_comments(text: str, design: CoreDesign, facts: CoreFacts) -> str:
    """Put the header before the SystemVerilog of a core, and a comment before each of its stages."""
    stages = {stage.name for stage in design.datapath.stages}
    others = module_lines(design)

    def described(match: re.Match[str]) -> str:
        part = match["part"]
        if part in stages:
            return _described(part, match[0], facts)
        return "".join(f"// {line}\n" for line in others.get(part.removeprefix("behind_"), ())) + match[0]

    module = re.compile(rf"^module {re.escape(facts.name)}_(?P<part>\w+)\(.*?^endmodule$", re.MULTILINE | re.DOTALL)
    return _header(design, facts) + module.sub(described, text)


def _described(stage: str, module: str, facts: CoreFacts) -> str:
    """Put what a stage computes above its module, and the formats of its nodes above their nets."""
    above = [line for section in _sections(stage, facts) for line in _section_lines(section)]
    for row in facts.formats:
        if row.stage == stage:
            line = f"{row.node}: {row.format}, {row.low:.6g} to {row.high:.6g} {in_comment(row.unit)}".rstrip()
            module, count = re.subn(_declaration(row.node), rf"  // {line}\n\g<0>", module, count=1, flags=re.MULTILINE)
            above += [line] * (not count)
    depth = max(map(int, re.findall(r"^  reg valid(\d+) ", module, re.MULTILINE)), default=0)
    above.append(
        f"{stage}: {depth} {'clock' if depth == 1 else 'clocks'} from a sample to its result, one sample a clock"
    )
    return "".join(f"// {line}\n" for line in above) + module


def _declaration(net: str) -> str:
    """Return a pattern for the declaration of a net, with the attributes before it."""
    return rf"^(?:  \(\*.*\n)*  (?:input|output|wire|reg) (?:\[\d+:0\] )?{re.escape(net)}(?=;| =)"


def _header(design: CoreDesign, facts: CoreFacts) -> str:
    core_pins = pins(design, facts.interface)
    return render(
        __package__,
        "header.sv.jinja",
        name=facts.name,
        title=_title(design, facts),
        version=__version__,
        sha256=hashlib.sha256(design.spec.text.encode()).hexdigest(),
        what=_promise(facts),
        timing=_timing(design, facts),
        pins=core_pins,
        width=max(len(pin.name) for pin in core_pins),
        recursions=[line for section in facts.sections for line in _section_lines(section)],
    )


def _title(design: CoreDesign, facts: CoreFacts) -> str:
    inputs = " and ".join(field.port.name for field in facts.interface.inputs.fields)
    (output,) = facts.interface.outputs.fields
    hardware = design.architecture.title(facts.realization)
    channels = "1 channel" if facts.channels == 1 else f"{facts.channels} channels"
    rate = frequency(float(design.spec.sample_rate))
    if facts.lower_rate is not None:
        rate += f", decimated by {facts.lower_rate.factor}"
    return f"{inputs} to {output.port.name}, {channels} at {rate}, {hardware}"


def _promise(facts: CoreFacts) -> Sequence[str]:
    (output,) = facts.interface.outputs.fields
    bound = f"{facts.error_bound:.6g} {in_comment(facts.unit)}".rstrip()
    return (
        f"Proven for all inputs in range: |{output.port.name} - exact| <= {bound}.",
        f"{facts.name}.certificate.json has the proof; `sosmith verify` repeats it.",
    )


def _timing(design: CoreDesign, facts: CoreFacts) -> Sequence[str]:
    every = "clock" if facts.cycles_per_sample == 1 else f"{facts.cycles_per_sample} clocks"
    taken, its = f"A sample is taken every {every} at best", "its sample"
    lanes = facts.interface.inputs.lanes
    if lanes > 1:
        taken, its = f"A beat of {lanes} samples is taken every {every} at best", "its beat"
    if facts.lower_rate is not None:
        decimation = facts.lower_rate
        taken = f"{decimation.factor} samples are taken every {decimation.cycles_per_result} clocks at best"
        taken += ", and a result is handed out as many times" * decimation.held
        its = "the last of its samples"
    ready = facts.interface.reset_cycles
    first = f", the first {ready} clocks after reset" if ready else ""
    return (
        f"Clock: {float(design.spec.hardware.clock) / 1e6:g} MHz in the specification. {taken}{first}.",
        f"A result leaves at most {facts.interface.latency_cycles} clocks after {its}, if neither waits for another.",
    )


def _sections(stage: str, facts: CoreFacts) -> list[SectionFacts]:
    return [section for section in facts.sections if section.name.split()[0] == stage]


def _section_lines(section: SectionFacts) -> list[str]:
    terms = [*_terms(section.b, "x", 1), *_terms((0.0, *section.a[1:]), "y", -1)]
    equation = f"{section.name}: y[n] = {' '.join(terms).removeprefix('+ ')}"
    # Look-ahead has some ten terms.
    lines = wrap(equation, _LINE, subsequent_indent="  ") if len(section.b) > 3 else [equation]
    if section.coefficients:
        parts = (f"{each.name} = {each.integer} / 2**{each.frac}" for each in section.coefficients)
        lines.append(f"  {', '.join(parts)}")
    return lines


def _terms(coefficients: Sequence[float], signal: str, sign: int) -> list[str]:
    terms = []
    for delay, coefficient in enumerate(coefficients):
        if coefficient:
            value = sign * coefficient
            at = f"{signal}[n-{delay}]" if delay else f"{signal}[n]"
            terms.append(f"{'-' if value < 0 else '+'} {abs(value):.9g} {at}")
    return terms
