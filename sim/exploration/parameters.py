"""What an exploration changes: keys of the specification, and for each its values or, for a search, its range."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from sosmith.gen.architectures.blocks import NO_LIMIT
from sosmith.gen.architectures.registry import candidates
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.realizations.registry import realizations_for
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.combinations import asked_by
from sosmith.gen.specification.specification import Specification
from sosmith.model.errors import SpecificationError


@dataclass(frozen=True)
class Span:
    """All numbers from `low` to `high`, both included: whole ones if both ends are."""

    low: int | float
    high: int | float

    @property
    def whole(self) -> bool:
        """Whether the numbers are whole ones."""
        return isinstance(self.low, int) and isinstance(self.high, int)

    def __str__(self) -> str:
        return f"{self.low}..{self.high}"


Values = Sequence[Any] | Span
Parameters = Mapping[str, Values]


def default_parameters(spec: Specification | ChainSpec) -> dict[str, Values]:
    """Return what is swept if nothing is asked for: realizations, architectures, word lengths by the allowed error.

    Look-ahead has realizations of its own, and like several samples a clock one architecture. The stages of a chain
    choose their own.
    """
    if isinstance(spec, ChainSpec):
        return {"output.max_error": _errors(spec.base)}
    looks_ahead = spec.hardware.pipeline == "look-ahead"
    parameters: dict[str, Values] = {}
    if not looks_ahead:
        parameters["hardware.realization"] = list(realizations_for(fir=spec.filter.is_fir))
        fastest_first = [kind.terms.name for kind in reversed(candidates(AUTO, NO_LIMIT, asked_by(spec)))]
        if len(fastest_first) > 1:
            parameters["hardware.architecture"] = fastest_first
    return {**parameters, "output.max_error": _errors(spec)}


def _errors(spec: Specification) -> list[float]:
    return [float(spec.max_error * factor) for factor in (1, 2, 4)]


def in_json(parameters: Parameters) -> dict[str, Any]:
    """Return parameters in the types of JSON, a span as its text."""
    return {key: str(values) if isinstance(values, Span) else list(values) for key, values in parameters.items()}


def read_parameter(text: str) -> tuple[str, Values]:
    """Read ``KEY=V1,V2`` or ``KEY=LOW..HIGH``: a key of the specification with dots, and values as in TOML.

    Names need no quotes.

    Raises
    ------
    SpecificationError
        If there is no key or no value, or a value cannot be read.
    """
    key, _, values = (part.strip() for part in text.partition("="))
    if not key or not values:
        raise SpecificationError(f"a parameter must be KEY=V1,V2,... or KEY=LOW..HIGH, not {text}")
    return key, read_span(values) or [_value(part, text) for part in _parts(values)]


def read_span(text: str) -> Span | None:
    """Read ``LOW..HIGH``; None for any other text.

    Raises
    ------
    SpecificationError
        If the first is not less than the second.
    """
    first, _, last = text.partition("..")
    try:
        low, high = _number(first), _number(last)
    except ValueError:
        return None
    if not -math.inf < low < high < math.inf:
        raise SpecificationError(f"a range must be LOW..HIGH with LOW less than HIGH, not {text}")
    return Span(low, high)


def _number(text: str) -> int | float:
    try:
        return int(text)
    except ValueError:
        return float(text)


def _parts(values: str) -> list[str]:
    """Split at commas outside of brackets and quotes."""
    parts, depth, quote = [""], 0, ""
    for sign in values:
        if sign in "\"'" and quote in {"", sign}:
            quote = "" if quote else sign
        depth += 0 if quote else (sign == "[") - (sign == "]")
        if sign == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += sign
    return [part.strip() for part in parts]


def _value(part: str, text: str) -> Any:
    if part.isidentifier() and part not in {"true", "false", "inf", "nan"}:
        return part
    try:
        return tomllib.loads(f"value = {part}\n")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        raise SpecificationError(f"a value must be one of TOML, or a name, not {part or 'nothing'} in {text}") from None


def plain(key: str, values: Sequence[Any]) -> list[Any]:
    """Return the values of a parameter in the types of JSON.

    Raises
    ------
    SpecificationError
        If JSON has no such value, or the same one comes twice.
    """
    read: dict[str, Any] = {}
    for value in map(_to_json, values):
        try:
            text = json.dumps(value, allow_nan=False)
        except (TypeError, ValueError):  # a date, or no finite number
            raise SpecificationError(
                f"{key} must have finite numbers, texts, true, false, or lists of these as its values, not {value}"
            ) from None
        if text in read:
            raise SpecificationError(f"{key} must have each of its values once, not {value} twice")
        read[text] = value
    return list(read.values())


def _to_json(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _to_json(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_to_json(item) for item in value]
    return float(value) if isinstance(value, Decimal) else value
