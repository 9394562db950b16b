"""Proves that the C model of a core computes the graphs of its certificate, without overflow or undefined behaviour.

The text is read token by token: whatever is not consumed is refused. The stages are read statement by statement
(`sosmith.verify.c_model.stages`); what stands around them has to be what is written in `sosmith.verify.c_model.frame`,
and the expressions of the flags those that follow from the certificate. Assumed are a compiler that rounds down where
it shifts a negative number to the right, and a caller that hands in codes and channels in their range.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.verify.c_model.cursor import Cursor
from sosmith.verify.c_model.expressions import HELD
from sosmith.verify.c_model.frame import (
    BEGIN,
    BLOCK,
    DECIMATOR,
    DOWNSAMPLED,
    DOWNSAMPLER,
    FILL,
    FIRST_FILLS,
    HEADER,
    RESET,
    STEP,
    SUMS,
    WARM_UP,
    WEAR,
    filled,
    ticks,
)
from sosmith.verify.c_model.stages import Stages
from sosmith.verify.certificate_file import Certificate, ItemEntry, Operation, PortEntry
from sosmith.verify.graph import require
from sosmith.verify.multirate.decimation import at_lower_rate

_RAIL, _OUTSIDE, _SATURATED, _SETTLING = 0, 1, 2, 5
"""Bits of a status."""

_PLAIN = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_HEADERS = {"stddef", "stdint", "string"}

_SUM_BITS = 62
"""Bits of a decimator's sums, so that they, and half an LSB more, fit 64 bits with a sign."""


@dataclass(frozen=True)
class ModelVerdict:
    """The result of the check of a C model: the number of nodes whose values its statements give, and of states."""

    nodes: int
    states: int


def check_c_model(source: str, header: str, certificate: Certificate, item: ItemEntry) -> ModelVerdict:
    """Prove that a C model computes the graphs of a certificate.

    Parameters
    ----------
    source, header : str
        Its two files.
    certificate : Certificate
        Its certificate, which `verify` has accepted.
    item : ItemEntry
        What it is about.

    Raises
    ------
    RejectedError
        If it computes anything else, or has anything that is not read; the sentence names the line.
    """
    return _Model(certificate, item).check(source, header)


class _Model:
    def __init__(self, certificate: Certificate, item: ItemEntry) -> None:
        self._certificate, self._item = certificate, item
        self._behind = at_lower_rate(certificate)
        self._name = certificate.name
        self._channel = "channel, " if len(item.wear) > 1 else ""

    @property
    def _fill(self) -> int:
        """How often the first sample goes in before it counts, where all results leave."""
        entry = self._certificate.downsampling
        return entry.filled if entry is not None and entry.factor == 1 else 0

    def check(self, source: str, header: str) -> ModelVerdict:
        """Read both files."""
        for name in (port.name for port in (*self._certificate.inputs, *self._behind.inputs)):
            require(
                _PLAIN.fullmatch(name) is not None, f"the name of an input must be a plain identifier, not {name!a}"
            )
        require(_PLAIN.fullmatch(self._name) is not None, "the name of a core must be a plain identifier")
        require(self._name not in _HEADERS, f"the name of a core must not be that of a header of C, {self._name}")
        states = self._read_header(Cursor(header, f"{self._name}.h"))
        cursor = Cursor(source, f"{self._name}.c")
        cursor.expect(filled(BEGIN, NAME=self._name))
        stages = Stages("", self._behind.stages, self._behind.inputs, states)
        stages.read(cursor, self._name)
        require(set(stages.owners) == set(states), "each state of the C model must be that of a stage")
        cursor.expect(filled(RESET, NAME=self._name))
        if self._item.wear:
            cursor.expect(self._wear())
        settles = self._behind.claims.settling is not None
        full = self._item.calibrated if self._certificate.decimation is None else ()
        status = self._status(stages, full, settles=settles, wear=True)
        cursor.expect(self._step(stages, self._parameters(stages.inputs, self._channel), status))
        cursor.expect(self._block(stages))
        nodes = self._nodes(stages) + self._read_decimator(cursor)
        cursor.end()
        return ModelVerdict(nodes, len(states))

    @staticmethod
    def _nodes(stages: Stages) -> int:
        return sum(len(stage.nodes) for stage in stages.stages)

    def _parameters(self, inputs: Sequence[PortEntry], channel: str = "") -> str:
        codes = ", ".join(f"int64_t {port.name}_code" for port in inputs)
        return f"size_t channel, {codes}" if channel else codes

    def _read_header(self, cursor: Cursor) -> dict[int, str]:
        """Read the header, and return the types of the states by their numbers."""
        before, _, after = HEADER.partition("STATES ")
        fields = {
            "GUARD": self._name.upper(),
            "NAME": self._name,
            "PARAMETERS": self._parameters(self._behind.inputs, self._channel),
            "WEAR": f"uint8_t {self._name}_wear_flags(size_t channel, int64_t code);" if self._item.wear else "",
            "DECIMATOR": self._decimator_words(DECIMATOR) + self._downsampler_words(DOWNSAMPLER),
        }
        cursor.expect(filled(before, **fields))
        states: dict[str, str] = {}
        while cursor.next != "}":
            kind = cursor.take("|".join(HELD))
            name = cursor.take(r"\w+")
            require(name not in states, f"{name} of the C model must be a state once")
            states[name] = kind
            cursor.expect(";")
        if self._fill:
            require(states.pop("started", "") == "int32_t", "the states of the C model must have started, of 32 bits")
        words = 0 if set(states) == {"none"} else len(states)
        wanted = {f"s{k}" for k in range(words)} or {"none"}
        require(set(states) == wanted, f"the states of the C model must be s0 and so on, or none, not {sorted(states)}")
        cursor.expect(filled(after, **fields))
        cursor.end()
        return {k: states[f"s{k}"] for k in range(words)}

    def _wear(self) -> str:
        limits = self._item.wear
        return filled(
            WEAR,
            NAME=self._name,
            COUNT=len(limits),
            LIMITS=", ".join(f"{{{warning}, {critical}}}" for warning, critical in limits),
            WHICH="channel" if len(limits) > 1 else 0,
            UNUSED="" if len(limits) > 1 else "(void)channel;",
        )

    def _step(self, stages: Stages, parameters: str, status: str) -> str:
        last = len(stages.stages) - 1
        return filled(
            STEP,
            PREFIX=stages.prefix,
            NAME=self._name,
            PARAMETERS=parameters,
            SET=" ".join(f"w.{member} = ({kind}){member};" for member, kind in self._members(stages)),
            RUN=" ".join(f"{stages.prefix}stage{index}(state, &w);" for index in range(last + 1)),
            STATUS=status,
            RESULT=stages.member((last, stages.stages[last].outputs[0])),
        )

    @staticmethod
    def _members(stages: Stages) -> list[tuple[str, str]]:
        """Return the members of the inputs, and their types."""
        return [(member, stages.fields[member]) for member in (f"{port.name}_code" for port in stages.inputs)]

    def _block(self, stages: Stages) -> str:
        count, last = len(stages.inputs), len(stages.stages) - 1
        codes = [f"in[(n * channels + c) * {count} + {index}]" for index in range(count)]
        arguments = ", ".join(f"{port.name}_code" for port in stages.inputs)
        given = zip(self._members(stages), codes, strict=True)
        words = {"NAME": self._name, "PARAMETERS": self._parameters(self._behind.inputs, self._channel)}
        words |= {"ARGUMENTS": self._channel + arguments, "FILLED": str(self._fill)}
        return filled(
            BLOCK,
            FIRST_FILLS=filled(FIRST_FILLS, **words) if self._fill else "",
            IN_STEP=f"fill(state, {self._channel}{arguments});" if self._fill else "",
            OPENS=f"{{ fill(&states[c], {'c, ' if self._channel else ''}in[at + c]);" if self._fill else "",
            ENDS="}" if self._fill else "",
            **words,
            CODES=("c, " if self._channel else "") + ", ".join(codes),
            BEHIND=last,
            INPUTS=count,
            TICKS=ticks(
                " ".join(f"w->{member} = ({kind}){code};" for (member, kind), code in given),
                last + 1,
                stages.member((last, stages.stages[last].outputs[0])),
            ),
        )

    def _status(
        self, stages: Stages, calibrated: tuple[tuple[int, int], ...], *, settles: bool = False, wear: bool = False
    ) -> str:
        """Return the expression of the flags."""
        conditions: dict[int, list[str]] = {_RAIL: [], _OUTSIDE: [], _SATURATED: []}
        for index, port in enumerate(stages.inputs):
            code = f"w.{port.name}_code"
            conditions[_RAIL] += [f"{code} == {port.lowest}", f"{code} == {port.highest}"]
            low, high = calibrated[index] if calibrated else (port.lowest, port.highest)
            conditions[_OUTSIDE] += [f"{code} < {low}"] if low > port.lowest else []
            conditions[_OUTSIDE] += [f"{code} > {high}"] if high < port.highest else []
        number = len(stages.stages) - 1
        last = stages.stages[number]
        node = last.nodes[last.outputs[0]]
        if node.op is Operation.CLAMP:
            before = f"w.{stages.member((number, node.operands[0]))}"
            conditions[_SATURATED] += [f"{before} < {_literal(node.low)}", f"{before} > {_literal(node.high)}"]
        terms = [f"({' || '.join(alternatives)}) << {bit}" for bit, alternatives in conditions.items() if alternatives]
        settling = ""
        if settles:
            settling = f"w.{stages.member((number, last.outputs[1]))} < 0"
            terms.append(f"({settling}) << {_SETTLING}")
        if wear and self._item.wear:
            result = stages.member((number, last.outputs[0]))
            worn = f"{self._name}_wear_flags({'channel' if self._channel else 0}, (int64_t)w.{result})"
            terms.append(f"({settling} ? 0 : {worn})" if settling else worn)
        return f"(uint8_t)({' | '.join(terms)})"

    def _read_decimator(self, cursor: Cursor) -> int:
        """Read what stands before a decimator, and that; return the number of nodes."""
        entry = self._certificate.decimation
        cursor.expect(self._downsampler_words(DOWNSAMPLED))
        if entry is None:
            return 0
        nodes = 0
        if entry.calibration is not None:
            stages = Stages("ahead_", entry.calibration.stages, self._certificate.inputs, {})
            stages.read(cursor, self._name)
            status = self._status(stages, self._item.calibrated)
            cursor.expect(self._step(stages, self._parameters(stages.inputs), status))
            nodes = self._nodes(stages)
        require(
            entry.width <= _SUM_BITS,
            f"a decimator of the C model must have at most {_SUM_BITS} bits, not {entry.width}",
        )
        cursor.expect(self._decimator_words(SUMS))
        return nodes

    def _downsampler_words(self, text: str) -> str:
        """Return a text about results that are left out with its words; an empty one where all leave."""
        entry = self._certificate.downsampling
        if entry is None or entry.factor == 1:
            return ""
        inputs = self._certificate.inputs
        arguments = self._channel + ", ".join(f"{port.name}_code" for port in inputs)
        rails = [f"{port.name}_code == {end}" for port in inputs for end in (port.lowest, port.highest)]
        return filled(
            text,
            NAME=self._name,
            TAKEN=self._parameters(inputs, self._channel),
            STARTED="started," if entry.filled else "",
            FILL=filled(FILL, FILLED=entry.filled, ARGUMENTS=arguments) if entry.filled else "",
            ARGUMENTS=arguments,
            SEEN=" || ".join(rails),
            FACTOR=entry.factor,
        )

    def _decimator_words(self, text: str) -> str:
        """Return a text about a decimator with its words; an empty one without a decimator."""
        entry = self._certificate.decimation
        if entry is None:
            return ""
        inputs = self._certificate.inputs
        codes = ", ".join(f"{port.name}_code" for port in inputs)
        taken, flags = inputs[0], "uint8_t flags;"
        calibrates, steady = entry.calibration is not None, self._certificate.ideal.start is not None
        return filled(
            text,
            NAME=self._name,
            STAGES=entry.stages,
            LAST=entry.stages - 1,
            TAKEN=self._parameters(inputs, self._channel),
            FIRST=f"{flags} const int64_t code = ahead_step(NULL, {codes}, &flags);"
            if calibrates
            else f"const int64_t code = {codes}; {flags}",
            STARTED="started," if steady else "",
            WARM_UP=filled(WARM_UP, WARM=entry.stages * entry.factor, FACTOR=entry.factor) if steady else "",
            FACTOR=entry.factor,
            KEPT="flags" if calibrates else "at_rail",
            SEEN="flags & 0x03" if calibrates else f"code == {taken.lowest} || code == {taken.highest}",
            HALF=1 << entry.dropped >> 1,
            DROPPED=entry.dropped,
            CHANNEL=self._channel,
            MASK="0x03" if calibrates else "0x01",
            PASSED="state->flags" if calibrates else "(state->at_rail ? 0x01 : 0)",
        )


def _literal(number: int) -> str:
    """Write a number in the narrowest type."""
    if abs(number) < 1 << 31:
        return f"INT32_C({number})"
    if abs(number) < 1 << 63:
        return f"INT64_C({number})"
    high, low = divmod(number, 1 << 62)
    return f"((__int128)INT64_C({high}) * (INT64_C(1) << 62) + INT64_C({low}))"
