"""Single edits of a core's SystemVerilog, at random, of the kinds that a mistake in a generator makes."""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator

Edit = tuple[str, str]
"""A line before and after."""

_NUMBER = re.compile(r"(\d+)'h([0-9a-f]+)")
_SLICE = re.compile(r"\[(\d+):(\d+)\]|(?<=[\w ])\[(\d+)\]")
_NAME = r"(?:\\\S+ |[A-Za-z_]\w*)"
_DECLARED = re.compile(rf"^ *(?:input|output|wire|reg) (?:\[(\d+):0\] )?({_NAME}) *(?:=.*)?;$")
_LOGIC = re.compile(r"^ *(?:assign|(?:else )?if|else [^i]|[\\\w$]\S* *(?:\[[^\]]*\] *)?<=|\.)")


def edits(text: str) -> dict[str, list[tuple[int, str]]]:
    """Return all edits of a text by kind: the number of a line, and what it becomes."""
    lines = text.splitlines()
    widths: dict[str, int] = {}
    nets: list[dict[str, int]] = []
    for line in lines:
        if line.startswith("module"):
            widths = {}
        declared = _DECLARED.match(line)
        if declared:
            widths[declared[2].strip()] = int(declared[1] or 0) + 1
        nets.append(widths)
    found: dict[str, list[tuple[int, str]]] = {kind: [] for kind in _KINDS}
    for number, line in enumerate(lines):
        for kind, change in _KINDS.items():
            found[kind] += [(number, new) for new in change(line, nets[number]) if new != line]
    return {kind: places for kind, places in found.items() if places}


def random_edits(text: str, count: int, seed: int) -> Iterator[tuple[str, str, Edit]]:
    """Yield kind, edited text, and the line before and after; all kinds are as likely."""
    rng = random.Random(seed)
    places = edits(text)
    lines = text.splitlines()
    for _ in range(count):
        kind = rng.choice(sorted(places))
        number, new = rng.choice(places[kind])
        yield kind, "\n".join([*lines[:number], new, *lines[number + 1 :]]) + "\n", (lines[number], new)


def swept(
    edited: Iterable[tuple[str, str, Edit]],
    rejection: Callable[[str], str],
    seen: Callable[[str], object],
    text: str,
    named: str = "$.",
) -> Counter[str]:
    """Check that each edit is rejected with a sentence, or changes nothing that is seen in simulation; count them."""
    right = seen(text)
    found: Counter[str] = Counter()
    for kind, other, edit in edited:
        sentence = rejection(other)
        if sentence:
            assert re.search(r"\bmust\b", sentence), (kind, edit, sentence)
            found["rejected"] += 1
            found["rejected, a node named"] += re.search(named, sentence) is not None
        else:
            assert seen(other) == right, (kind, edit)
            found["accepted"] += 1
        found[f"{'rejected' if sentence else 'accepted'}: {kind}"] += 1
    return found


def _right(line: str) -> tuple[str, str]:
    """Split a line of logic into what is before its expression, and the expression."""
    head, sign, tail = line.partition(" = " if line.lstrip().startswith("assign") else " <= ")
    return (head + sign, tail) if sign else (line, "")


def _swapped(line: str, _nets: dict[str, int]) -> Iterator[str]:
    head, tail = _right(line)
    found = re.fullmatch(r"(.+?) +([-<>]) (.+);", tail)
    if found:
        yield f"{head}{found[3]} {found[2]} {found[1]};"


def _sides(line: str, _nets: dict[str, int]) -> Iterator[str]:
    head, tail = _right(line)
    found = re.fullmatch(r"(.+?) \? (.+) : (.+);", tail)
    if found:
        yield f"{head}{found[1]} ? {found[3]} : {found[2]};"


def _one_bit(line: str, _nets: dict[str, int]) -> Iterator[str]:
    if _LOGIC.match(line) or " = " in line:
        for found in _NUMBER.finditer(line):
            for bit in range(int(found[1])):
                value = int(found[2], 16) ^ 1 << bit
                yield f"{line[: found.start()]}{found[1]}'h{value:x}{line[found.end() :]}"


def _moved_slice(line: str, nets: dict[str, int]) -> Iterator[str]:
    if _LOGIC.match(line):
        for found in _SLICE.finditer(line):
            for step in (-1, 1):
                high, low = (int(found[k] or found[3]) + step for k in (1, 2))
                if low >= 0:
                    bits = f"[{high}:{low}]" if found[1] else f"[{high}]"
                    yield line[: found.start()] + bits + line[found.end() :]


def _narrower(line: str, _nets: dict[str, int]) -> Iterator[str]:
    if _LOGIC.match(line):
        for found in re.finditer(r"\[(\d+):(\d+)\]", line):
            if int(found[1]) > int(found[2]):
                yield f"{line[: found.start()]}[{int(found[1]) - 1}:{found[2]}]{line[found.end() :]}"


def _shifted(line: str, _nets: dict[str, int]) -> Iterator[str]:
    for found in re.finditer(r"(\d+)'h0+ +\}", line):
        for bits in (int(found[1]) - 1, int(found[1]) + 1):
            if bits:
                yield f"{line[: found.start()]}{bits}'h0 }}{line[found.end() :]}"


def _unsigned(line: str, _nets: dict[str, int]) -> Iterator[str]:
    if "$signed(" in line:
        yield re.sub(r"\$signed\(((?:[^()]|\([^()]*\))*)\)", r"\1", line)
        yield re.sub(r"\$signed\(((?:[^()]|\([^()]*\))*)\)", r"\1", line, count=1)


def _operator(line: str, _nets: dict[str, int]) -> Iterator[str]:
    head, tail = _right(line)
    for old, new in ((" + ", " - "), (" - ", " + "), (" & ", " | "), (" | ", " & "), (" < ", " > "), (" > ", " < ")):
        if tail and old in tail:
            yield head + tail.replace(old, new, 1)
    for old, new in (("~ ", ""), ("& ", "| "), ("| ", "& ")):
        if tail.startswith(old):
            yield head + new + tail[len(old) :]


def _condition(line: str, nets: dict[str, int]) -> Iterator[str]:
    found = re.match(rf"^( *(?:else )?if \()(!?)({_NAME})(.*)$", line)
    if found:
        yield f"{found[1]}{'' if found[2] else '!'}{found[3]}{found[4]}"
        for name, width in nets.items():
            if width == 1:
                yield f"{found[1]}{found[2]}{name} {found[4]}"


def _another_net(line: str, nets: dict[str, int]) -> Iterator[str]:
    """Replace a net on the right by another one of the same width: a wrong operand or a wrong pipeline tap."""
    start = line.find("(") if line.lstrip().startswith(".") else len(_right(line)[0])
    if not _LOGIC.match(line) or (_right(line)[1] == "" and not line.lstrip().startswith(".")):
        return
    for found in re.finditer(_NAME, line):
        own = found[0].strip()
        if found.start() < start or own not in nets or line[found.start() - 1] == "'":
            continue
        for name, width in nets.items():
            if width == nets[own] and name != own:
                yield f"{line[: found.start()]}{name} {line[found.end() :]}"


def _ordered(line: str, _nets: dict[str, int]) -> Iterator[str]:
    found = re.search(r"\{ ((?:[^{}])+?) ?, ([^{}]+?) +\}", line)
    if found and _LOGIC.match(line):
        yield f"{line[: found.start()]}{{ {found[2]} , {found[1]}  }}{line[found.end() :]}"


_KINDS: dict[str, Callable[[str, dict[str, int]], Iterator[str]]] = {
    "operands swapped": _swapped,
    "sides of a choice swapped": _sides,
    "a bit of a constant": _one_bit,
    "a slice moved": _moved_slice,
    "a slice narrower": _narrower,
    "another shift": _shifted,
    "no sign": _unsigned,
    "another operator": _operator,
    "another condition": _condition,
    "another net": _another_net,
    "parts swapped": _ordered,
}
