"""The goals of the proof of a parallel core's hardware, one text for each register, for solvers of bit vectors.

The proof itself (`sosmith.verify.parallel.check`) decides by normal forms over the integers. Here the same goals go to
whoever decides SMT-LIB: the logic in front of a register, as it is in the SystemVerilog, must give what the register is
to hold of its sample, for all inputs, states and samples in the pipeline, within the ranges of the certificate::

    registers and inputs --> logic of the text, in words --> next value  =  form, in wide words  <-- ranges
         each holds its form, cut to its width

A register of a recursion must take over the code of the graph's node, be 0 after a reset, and stay where no sample
moves. One behind the pipeline's other positions must take over what it is known by when others read it. What leaves
must be the output of the graph. The texts say ``unsat`` to a solver where that holds, and ``sat`` where it does not.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from functools import partial

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.parallel.check import CLOCK, OUTPUT
from sosmith.verify.parallel.control import RESET, Case, Control, cases, find_control
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.parallel.graph_codes import GraphCodes
from sosmith.verify.parallel.netlist import Netlist, flattened
from sosmith.verify.parallel.pipeline import Pipeline
from sosmith.verify.parallel.smt.form_terms import FormTerms
from sosmith.verify.parallel.smt.script import Script, Term, cut, number
from sosmith.verify.parallel.smt.words import Words
from sosmith.verify.parallel.split import split
from sosmith.verify.program.normal_form import Form
from sosmith.verify.reader.recursion import deep_recursion
from sosmith.verify.reader.source import read_modules

Goal = tuple[Case, int, Form | None]
"""A case of the control signals, the position of the sample, and what is taken over; None if nothing is."""


def obligations(text: str, certificate: Certificate) -> dict[str, str]:
    """Return the goals, by the name of the register or output.

    Parameters
    ----------
    text : str
        SystemVerilog of a parallel core with one channel and one sample a clock.
    certificate : Certificate
        Its certificate, which `verify` has accepted.

    Raises
    ------
    RejectedError
        If the text has anything that no goals are written for.
    """
    require("s_axil_" not in text, "the constants must be fixed to be checked, not loadable at run time")
    modules = read_modules(text, certificate.name)
    require("s_axis_tdest" not in next(iter(modules.values())).ports, "there must be one channel, not several")
    with deep_recursion():
        return dict(_Goals(flattened(modules, CLOCK), certificate).texts())


class _Goals:
    def __init__(self, netlist: Netlist, certificate: Certificate) -> None:
        require(not netlist.memories, "goals for solvers must be of a core without memories")
        self._forms = Forms()
        self._graph = GraphCodes(certificate, self._forms)
        kept = {netlist.holder(self._graph.state_name(node)) or "" for node in self._graph.delays}
        self._netlist = split(netlist, kept)
        self._control: Control = find_control(self._netlist)
        self._pipeline = Pipeline(self._netlist, self._control, self._graph, self._forms, certificate)
        self._certificate = certificate

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yield names and texts."""
        states = self._pipeline.states
        for name in sorted(states):
            yield name, self._register(name, self._of_state(name))
        output = self._output()
        inside = sorted(self._inside())
        for name in inside:
            yield name, self._register(name, self._of_data(name))
        yield output

    def _inside(self) -> set[str]:
        """Return the registers of the pipeline that hold words of a sample, or a constant."""
        names = {
            name for name in self._netlist.registers if name not in self._control.names | self._pipeline.states.keys()
        }
        known = set()
        for name in names:
            try:
                behind = self._pipeline.behind(name)
            except RejectedError:
                continue
            constant = behind is None and self._pipeline.constant_of(name) is not None
            if constant or (behind is not None and 0 <= behind < self._pipeline.last):
                known.add(name)
        return known

    def _of_state(self, name: str) -> list[Goal]:
        state = self._pipeline.states[name]
        node = self._graph.nodes[state.node]
        (source,) = node.operands
        full, valid = self._control.full, self._control.valid[state.behind]
        taken = self._graph.seen(source, node.stage)
        return [
            ({RESET: 0}, -1, {}),
            ({RESET: 1, full: 0, valid: 1}, state.behind, taken),
            ({RESET: 1, full: 1}, -1, None),
            ({RESET: 1, full: 0, valid: 0}, -1, None),
        ]

    def _of_data(self, name: str) -> list[Goal]:
        behind = self._pipeline.behind(name)
        valid, full = self._control.valid, self._control.full
        if behind is None:
            always = self._pipeline.constant_of(name)
            return [({RESET: 1, full: 0}, 1, always), ({RESET: 1, full: 1}, 1, None)]
        return [
            ({RESET: 1, full: 0, valid[behind]: 1}, behind, self._pipeline.content_of(name)),
            ({RESET: 1, full: 1, valid[behind + 1]: 1}, behind, None),
        ]

    def _register(self, name: str, goals: Sequence[Goal]) -> str:
        """Return the text for a register: in no case can it take over anything else."""
        script, register = Script(), self._netlist.registers[name]
        terms = self._terms(script)
        pairs: list[tuple[Term, Term]] = []
        for fixed, position, wanted in goals:
            following = partial(self._next, name, position, script, terms)
            for _, (held, taken) in cases(fixed, following):
                pairs.append((taken, held if wanted is None else terms.word(wanted, register.width)))
        self._assume_ranges(script, terms)
        return script.refuting(f"{name} takes over what it must, or keeps what it holds", pairs)

    def _next(self, name: str, position: int, script: Script, terms: FormTerms, case: Case) -> tuple[Term, Term]:
        """Return what a register holds, and what it holds at the next clock."""
        words = self._words(position, case, script, terms)
        held = words.net(name)
        return held, words.following(self._netlist.registers[name].statements, held)

    def _words(self, position: int, case: Case, script: Script, terms: FormTerms) -> Words:
        content = self._pipeline.seen_from(position, case, 0)
        control = self._control.names

        def held(name: str) -> Term:
            width = self._netlist.widths[name]
            if name in case:
                return number(case[name], width)
            if name in control:
                return self._free(script, ("control", name), width)
            try:
                return terms.word(content(name), width)
            except RejectedError:  # of no one sample, as in a buffer: it may hold anything
                return self._free(script, ("any", name), width)

        return Words(self._netlist, script, held, frozenset(self._control.cuts))

    def _free(self, script: Script, key: Hashable, width: int) -> Term:
        known = script.known(key)
        return script.declare(key, width, self._shown(key)) if known is None else known

    def _output(self) -> tuple[str, str]:
        """Return the goal of the data that leave: with the last position's words, the code of the graph's output."""
        script = Script()
        terms = self._terms(script)
        (lane,) = self._graph.lanes
        last = self._pipeline.last
        fixed = {RESET: 1, self._control.full: 0, self._control.valid[last]: 1}
        width = -(-self._certificate.output.bits // 8) * 8
        buffered = sorted(self._held_by_output())
        pairs: list[tuple[Term, Term]] = []
        for _, word in cases(fixed, lambda case: self._taken_by_output(buffered, last, case, script, terms)):
            pairs.append((cut(word, 0, width), terms.word(self._graph.seen(lane.output, ""), width)))
        self._assume_ranges(script, terms)
        return OUTPUT, script.refuting(f"{OUTPUT} takes over the output of the graph", pairs)

    def _held_by_output(self) -> set[str]:
        """Return the registers that the data which leave are made of."""
        names: set[str] = set()
        pending = [OUTPUT]
        seen: set[str] = set()
        while pending:
            name = pending.pop()
            if name in seen:
                continue
            seen.add(name)
            if name in self._netlist.registers:
                names.add(name)
                continue
            for driver in self._netlist.drivers.get(name, ()):
                pending += _names(driver.value)
        return names

    def _taken_by_output(
        self, buffered: Sequence[str], position: int, case: Case, script: Script, terms: FormTerms
    ) -> Term:
        """Return the data that leave after the next clock, which brings the sample at the last position."""
        buffer = self._control.output
        moving = {**case, buffer.valid: 0, buffer.ready: 0, buffer.coming: 1}
        words = self._words(position, moving, script, terms)
        following = {
            name: words.following(self._netlist.registers[name].statements, words.net(name)) for name in buffered
        }
        return Words(self._netlist, script, following.__getitem__).net(OUTPUT)

    def _terms(self, script: Script) -> FormTerms:
        return FormTerms(self._forms, script, self._graph.definitions, self._shown)

    def _assume_ranges(self, script: Script, terms: FormTerms) -> None:
        """Assume the ranges that the certificate states of the nodes whose ranges need more than their operands'."""
        for index, node in enumerate(self._graph.nodes):
            if node.entry.op is Operation.BOUND and self._is_about(self._graph.codes[index], script):
                exact = script.define(terms.exact(self._graph.codes[index]))
                low, high = node.entry.low, node.entry.high
                if low > -(1 << exact.width - 1) or high < (1 << exact.width - 1) - 1:
                    _within(script, exact, low, high)

    def _is_about(self, form: Form, script: Script) -> bool:
        """Whether all variables of a form are in the script."""
        return all(script.known(key) is not None for key in self._forms.keys(form))

    def _shown(self, key: Hashable) -> str:
        if isinstance(key, tuple) and len(key) == 2 and isinstance(key[0], int):
            label = self._graph.nodes[key[0]].label
            return f"{label}, {key[1]} samples ago" if key[1] else label
        return " ".join(map(str, key[:2])) if isinstance(key, tuple) else str(key)


def _within(script: Script, term: Term, low: int, high: int) -> None:
    least, most = -(1 << term.width - 1), (1 << term.width - 1) - 1
    script.assume_within(term, max(low, least), min(high, most))


def _names(value: object) -> list[str]:
    """Return the nets in an expression."""
    if hasattr(value, "name"):
        return [value.name]
    parts = getattr(value, "parts", None) or getattr(value, "operands", None) or ()
    return [name for part in parts for name in _names(part)]
