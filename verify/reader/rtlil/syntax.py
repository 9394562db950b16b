"""Reads RTLIL as it is written for a core, line by line: whatever is not of that form is refused."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from sosmith.verify.graph import require

Bit = tuple[str, int] | str
"""A bit of a net by its name and place, or ``0``, ``1``, ``x`` or ``-``."""

_NAME = r"(?:\\[A-Za-z_$][\w$]*|\$\d+)"
_CONST = r"\d+'[01x-]*"
_LINES = {
    "attribute": re.compile(r'attribute \\(\w+) (?:(\d+)|([0-9]+\'[01x-]*)|"[\w ().,:-]*")', re.ASCII),
    "module": re.compile(r"module \\(\w+)", re.ASCII),
    "wire": re.compile(rf"wire width (\d+)(?: (input|output) \d+ )?(?: signed)? ({_NAME})", re.ASCII),
    "memory": re.compile(rf"memory width (\d+) size (\d+) ({_NAME})", re.ASCII),
    "cell": re.compile(rf"cell (\$?\\?\w+) ({_NAME})", re.ASCII),
    "parameter": re.compile(rf'parameter(?: signed)? \\(\w+) (?:(\d+)|({_CONST})|"\\(\\[\w$]+)")', re.ASCII),
    "connect": re.compile(r"connect (\S.*)"),
    "process": re.compile(rf"process {_NAME}", re.ASCII),
    "assign": re.compile(r"assign (\S.*)"),
    "switch": re.compile(r"switch (\S.*)"),
    "case": re.compile(rf"case(?: ({_CONST}(?:, {_CONST})*))?", re.ASCII),
    "end": re.compile(r"end"),
}
_ATTRIBUTES = re.compile(r"generator|top|init|keep|no_rw_check|ram_style|enum_base_type|enum_value_[01]+", re.ASCII)
"""What may be said of modules, nets and memories, none of which changes what they do but the first values."""

_TOKEN = re.compile(rf" *(?:({_NAME})(?: \[(\d+)(?::(\d+))?\])?|({_CONST})|([{{}}]))", re.ASCII)
_WIDEST = 1 << 16


class Wire(NamedTuple):
    """A net: its width, its direction if it is a port, what it holds before the first clock, and whether it is kept."""

    width: int
    direction: str
    first: str | None
    kept: bool = False


@dataclass
class Cell:
    """A cell: its kind, its parameters, and what is connected."""

    kind: str
    parameters: dict[str, int | str] = field(default_factory=dict)
    ports: dict[str, list[Bit]] = field(default_factory=dict)

    def number(self, key: str) -> int:
        """Return a parameter that is a number.

        Raises
        ------
        RejectedError
            If it is not.
        """
        value = self.parameters.get(key)
        require(isinstance(value, int), f"the parameter {key} of a cell {self.kind} must be a number")
        assert isinstance(value, int)
        return value


@dataclass
class Case:
    """What is done in a case: bits that are set, then choices, each a word and its cases with their patterns."""

    sets: dict[tuple[str, int], Bit] = field(default_factory=dict)
    choices: list[tuple[list[Bit], list[tuple[list[str], Case]]]] = field(default_factory=list)

    def touches(self, bit: tuple[str, int]) -> bool:
        """Whether a bit is set anywhere in it."""
        return bit in self.sets or any(case.touches(bit) for _, cases in self.choices for _, case in cases)

    def targets(self) -> set[tuple[str, int]]:
        """Return all bits that are set in it."""
        targets = set(self.sets)
        for _, cases in self.choices:
            for _, case in cases:
                targets |= case.targets()
        return targets


@dataclass
class RtlilModule:
    """A module as it is written; names without the backslash of what has one in the text."""

    wires: dict[str, Wire] = field(default_factory=dict)
    memories: dict[str, tuple[int, int, bool]] = field(default_factory=dict)
    cells: dict[str, Cell] = field(default_factory=dict)
    processes: list[Case] = field(default_factory=list)
    connects: list[tuple[list[Bit], list[Bit]]] = field(default_factory=list)


def read_rtlil(text: str) -> dict[str, RtlilModule]:
    """Read the modules of an RTLIL text.

    Raises
    ------
    RejectedError
        If a line is of no known form.
    """
    return _Reader(text).modules()


class _Reader:
    def __init__(self, text: str) -> None:
        self._lines = [(number, line.strip(" ")) for number, line in enumerate(text.split("\n"), 1) if line.strip(" ")]
        self._place = 0
        self._module = RtlilModule()
        self._said: dict[str, str] = {}

    def _take(self, *kinds: str) -> tuple[str, re.Match[str]]:
        """Take the next line, which must be of one of these kinds."""
        number, line = self._lines[self._place] if self._place < len(self._lines) else (0, "")
        kind = line.partition(" ")[0]
        match = _LINES[kind].fullmatch(line) if kind in kinds else None
        require(match is not None, f"line {number} of the RTLIL must be {' or '.join(kinds)}, not {line[:60]!a}")
        assert match is not None
        self._place += 1
        return kind, match

    def modules(self) -> dict[str, RtlilModule]:
        modules: dict[str, RtlilModule] = {}
        while self._place < len(self._lines):
            kind, match = self._take("attribute", "module")
            if kind == "attribute":
                self._note(match)
                continue
            require(match[1] not in modules, f"the module {match[1]} of the RTLIL must be there once")
            self._module = modules[match[1]] = RtlilModule()
            self._said = {}
            while self._item():
                pass
        return modules

    def _note(self, match: re.Match[str]) -> None:
        require(_ATTRIBUTES.fullmatch(match[1]) is not None, f"the RTLIL must not have the attribute {match[1]}")
        self._said[match[1]] = match[3] or match[2] or ""

    def _item(self) -> bool:
        """Read one item of a module; return whether more may follow."""
        kind, match = self._take("attribute", "wire", "memory", "cell", "process", "connect", "end")
        module = self._module
        if kind == "attribute":
            self._note(match)
            return True
        said, self._said = self._said, {}
        if kind == "wire":
            name, width = _plain(match[3]), int(match[1])
            require(name not in module.wires and width <= _WIDEST, f"{name} of the RTLIL must be a net once")
            module.wires[name] = Wire(width, match[2] or "", said.get("init"), "keep" in said)
        elif kind == "memory":
            name = _plain(match[3])
            require(name not in module.memories, f"{name} of the RTLIL must be a memory once")
            module.memories[name] = int(match[1]), int(match[2]), "no_rw_check" in said
        elif kind == "cell":
            name = _plain(match[2])
            require(name not in module.cells, f"{name} of the RTLIL must be a cell once")
            module.cells[name] = self._cell(match[1])
        elif kind == "process":
            module.processes.append(self._case())
            self._take("end")
        elif kind == "connect":
            module.connects.append(self._pair(match[1]))
        return kind != "end"

    def _cell(self, kind: str) -> Cell:
        cell = Cell(kind)
        while True:
            what, match = self._take("parameter", "connect", "end")
            if what == "end":
                return cell
            if what == "parameter":
                require(match[1] not in cell.parameters, f"{match[1]} of a cell {kind} must be given once")
                words = match[2], match[3], match[4]
                cell.parameters[match[1]] = int(words[0]) if words[0] else _number(words[1]) if words[1] else words[2]
            else:
                port, _, rest = match[1].partition(" ")
                require(re.fullmatch(_NAME, port) is not None, f"a port of a cell must have a name, not {port!a}")
                require(_plain(port) not in cell.ports, f"{port} of a cell {kind} must be connected once")
                cell.ports[_plain(port)] = self._bits(rest)

    def _case(self) -> Case:
        case = Case()
        while self._next() in {"assign", "switch"}:
            kind, match = self._take("assign", "switch")
            if kind == "assign":
                require(not case.choices, "a case of the RTLIL must set bits before it chooses")
                targets, values = self._pair(match[1])
                for target, value in zip(targets, values, strict=True):
                    require(isinstance(target, tuple), "what is set in the RTLIL must be a net")
                    assert isinstance(target, tuple)
                    case.sets[target] = value
                continue
            word, cases = self._bits(match[1]), []
            while self._next() == "case":
                _, header = self._take("case")
                patterns = [each.partition("'")[2] for each in (header[1] or "").split(", ") if each]
                right = all(len(pattern) == len(word) and "x" not in pattern for pattern in patterns)
                require(right, "a case of the RTLIL must have as many bits as what is chosen by")
                cases.append((patterns, self._case()))
            self._take("end")
            case.choices.append((word, cases))
        return case

    def _next(self) -> str:
        return self._lines[self._place][1].partition(" ")[0] if self._place < len(self._lines) else ""

    def _pair(self, text: str) -> tuple[list[Bit], list[Bit]]:
        """Read two words of the same width."""
        end = _word_end(text)
        left, right = self._bits(text[:end]), self._bits(text[end:])
        require(len(left) == len(right), f"both sides of {text[:60]!a} must have the same width")
        return left, right

    def _bits(self, text: str) -> list[Bit]:
        """Read a word, the lowest bit first."""
        parts: list[list[Bit]] = []
        place, inside = 0, False
        while place < len(text.rstrip(" ")):
            match = _TOKEN.match(text, place)
            require(match is not None, f"{text[:60]!a} of the RTLIL must be a word")
            assert match is not None
            place = match.end()
            if match[5]:
                require((match[5] == "{") != inside, f"{text[:60]!a} of the RTLIL must be a word")
                inside = not inside
            elif match[4]:
                width, _, digits = match[4].partition("'")
                require(int(width) == len(digits), f"{match[4]} of the RTLIL must have as many digits as bits")
                parts.append(list(reversed(digits)))
            else:
                parts.append(self._slice(_plain(match[1]), match[2], match[3]))
        require(not inside, f"{text[:60]!a} of the RTLIL must be a word")
        return [bit for part in reversed(parts) for bit in part]

    def _slice(self, name: str, high: str | None, low: str | None) -> list[Bit]:
        require(name in self._module.wires, f"{name} of the RTLIL must be a net before it is used")
        width = self._module.wires[name].width
        first, last = (0, width - 1) if high is None else (int(low if low is not None else high), int(high))
        require(first <= last < width or width == 0, f"{name} of the RTLIL must have the bits {last} to {first}")
        return [(name, place) for place in range(first, last + 1)]


def _word_end(text: str) -> int:
    """Return where the first word of a text ends."""
    if text.startswith("{"):
        return text.index("}") + 1 if "}" in text else len(text)
    match = _TOKEN.match(text)
    return match.end() if match else len(text)


def _plain(name: str) -> str:
    return name.removeprefix("\\")


def _number(text: str) -> int | str:
    digits = text.partition("'")[2]
    return int(digits or "0", 2) if set(digits) <= {"0", "1"} else digits
