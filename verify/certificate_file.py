"""The file format of a certificate.

A certificate is a JSON text. Integers are JSON integers, rationals are strings ``"p/q"`` in lowest terms, or ``"p"``;
there are no floating-point numbers in it. The sum of an infinite series is stored as the next multiple of ``2**-64``
above it (`on_grid`), so that anyone who computes it accurately enough gets the same number.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from enum import Enum
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, ValidationError
from pydantic_core import ErrorDetails

from sosmith.model.errors import SpecificationError
from sosmith.verify.given_file import read_given

FORMAT = "sosmith certificate 2"
_GRID_BITS = 64
_MAX_BYTES = 1 << 26  # of a file: large ones have some millions
_MAX_BITS = 4096  # of any number: far beyond any design, and few enough to keep the arithmetic fast
_MAX_DIGITS = 1300  # of an integer in the file: slightly more than _MAX_BITS
_RATIONAL = re.compile(r"(-?[0-9]{1,1200})(?:/([0-9]{1,1200}))?")


def on_grid(value: Fraction) -> Fraction:
    """Smallest multiple of ``2**-64`` that is greater than `value` by more than ``2**-128``.

    What that adds is room for the filter asked for: the one that is proven has rationals rounded to ``2**-192``. Where
    taps are decimal and a range is a multiple of five LSB, errors often lie on the grid but for that rounding.

    >>> on_grid(Fraction(1, 2) - Fraction(1, 2**190)) == on_grid(Fraction(1, 2)) == Fraction(1, 2) + Fraction(1, 2**64)
    True
    """
    return Fraction(math.floor(value * 2**_GRID_BITS + Fraction(1, 2**_GRID_BITS)) + 1, 2**_GRID_BITS)


def below_on_grid(value: Fraction) -> Fraction:
    """Largest multiple of ``2**-64`` that is less than `value` by more than ``2**-128``."""
    return -on_grid(-value)


def _rational(value: object) -> object:
    if isinstance(value, Fraction):
        return value
    match = _RATIONAL.fullmatch(value) if isinstance(value, str) else None
    if match is None or int(match[2] or 1) == 0:
        raise ValueError('must be a rational number as a text "p/q"')
    number = Fraction(int(match[1]), int(match[2] or 1))
    if str(number) != value:
        raise ValueError('must be a rational number in lowest terms as a text "p/q", or "p"')
    return number


Rational = Annotated[Fraction, BeforeValidator(_rational), PlainSerializer(str)]
Integer = Annotated[int, Field(strict=True, ge=-(2**_MAX_BITS), le=2**_MAX_BITS)]
Exponent = Annotated[int, Field(strict=True, ge=-_MAX_BITS, le=_MAX_BITS)]
Index = Annotated[int, Field(strict=True, ge=0, lt=10_000)]
Text = Annotated[str, Field(strict=True, max_length=1000)]


LongText = Annotated[str, Field(strict=True, max_length=1 << 16)]


def _sha256(value: object) -> object:
    if isinstance(value, str) and re.fullmatch("[0-9a-f]{64}", value) is None:
        raise ValueError("must be a SHA-256 of 64 hexadecimal digits")
    return value


Sha256 = Annotated[str, BeforeValidator(_sha256), Field(strict=True)]


class Entry(BaseModel):
    """A part of a file of claims."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class PortEntry(Entry):
    """An input or output: physical value = zero + lsb * code."""

    name: Text
    bits: Annotated[int, Field(strict=True, ge=2, le=32)]
    signed: Annotated[bool, Field(strict=True)]
    lsb: Rational
    zero: Rational
    unit: Text

    @property
    def lowest(self) -> int:
        """Smallest code."""
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def highest(self) -> int:
        """Largest code."""
        return (1 << (self.bits - int(self.signed))) - 1


class Operation(Enum):
    """What a node does with its operands, by its name in the file."""

    INPUT = "input"
    CONSTANT = "constant"
    ADD = "add"
    SUBTRACT = "subtract"
    SHIFT = "shift"  # multiplies by 2**parameter: the same code with another binary point
    SCALE = "scale"  # multiplies by the constant parameter * 2**-parameter_frac
    MULTIPLY = "multiply"
    FLOOR = "floor"  # rounds down to `frac` fraction bits
    FRACTION = "fraction"  # the bits that FLOOR to `parameter` fraction bits drops
    TRUNCATE = "truncate"  # rounds towards zero to `frac` fraction bits
    CLAMP = "clamp"  # limits to low..high
    BOUND = "bound"  # passes on the operand, which is claimed to stay in low..high
    DELAY = "delay"  # the operand at the previous sample; 0 at reset


class NodeEntry(Entry):
    """A node of a dataflow graph: its value is its code times ``2**-frac``, and the code stays in low..high.

    `operands` are indices of nodes in the same stage. Only a DELAY may refer to a later node.
    """

    op: Operation
    operands: tuple[Index, ...] = ()
    frac: Exponent
    low: Integer
    high: Integer
    parameter: Integer = 0
    parameter_frac: Exponent = 0
    name: Text = ""


class StageEntry(Entry):
    """A stage of the datapath."""

    name: Text
    role: Literal["polynomial", "start", "section", "output"]
    nodes: Annotated[tuple[NodeEntry, ...], Field(min_length=1, max_length=10_000)]
    outputs: Annotated[tuple[Index, ...], Field(min_length=1)]


class SectionEntry(Entry):
    """An ideal section: coefficients of powers of ``z**-1``, the constant one first.

    Only the first one may have a numerator of more than three: all of that of a sampled filter.
    """

    numerator: Annotated[tuple[Rational, ...], Field(min_length=1, max_length=512)]
    denominator: Annotated[tuple[Rational, ...], Field(min_length=1, max_length=3)]


class IdealEntry(Entry):
    """The exact calculation that the hardware approximates.

    `polynomial` holds the calibration's coefficients in physical units: row i is for the first input to the power i.
    It is None if the only input is used as it is. The sections begin with states of 0, or, if `start` is "steady", with
    those that they would have if the first sample had been there for ever.
    """

    polynomial: tuple[Annotated[tuple[Rational, ...], Field(min_length=1)], ...] | None
    sections: Annotated[tuple[SectionEntry, ...], Field(max_length=64)]
    start: Literal["steady"] | None = None


class BandEntry(Entry):
    """The largest gain of anything in the band around a multiple of the lower rate, half of it to both sides.

    `at` is the frequency at the output, in units of the lower rate, at which hardly less is reached: `gain` is that,
    a 1024th of it more, rounded up to the grid.
    """

    gain: Rational
    at: Rational


class DecimationEntry(Entry):
    """A CIC filter before the stages, which hands on every `factor`-th sample.

    `stages` integrators and combs of `width` bits; the rounding to nearest behind them drops `dropped` bits. The first
    result is that of the first sample, as if that had been there for ever. `correction` is the weight g of the ideal
    section ``1 + g - g / z``, the last one. `edge` is the upper edge of the pass band, in units of the rate of the
    input, and `aliasing` bounds the gain of what folds into it from around each multiple of the lower rate. `passing`
    are the largest gains to the output of what folds into it from there, the filter's own gain included, and `bands`
    those from the whole band around each of them. It takes the only input, or what a `calibration` makes of the inputs.
    """

    factor: Annotated[int, Field(strict=True, ge=2, le=1 << 10)]
    stages: Annotated[int, Field(strict=True, ge=1, le=16)]
    width: Annotated[int, Field(strict=True, ge=2, le=256)]
    dropped: Annotated[int, Field(strict=True, ge=0, le=256)]
    correction: Rational
    edge: Rational
    aliasing: Annotated[tuple[Rational, ...], Field(max_length=1 << 9)]
    passing: Annotated[tuple[BandEntry, ...], Field(min_length=1, max_length=1 << 9)]
    bands: Annotated[tuple[BandEntry, ...], Field(min_length=1, max_length=1 << 9)]
    calibration: CalibrationEntry | None = None


class DownsamplingEntry(Entry):
    """An FIR filter of which every `factor`-th result leaves, the first one that of the first sample; with 1, all do.

    That sample goes in `filled` times before it counts.
    """

    factor: Annotated[int, Field(strict=True, ge=1, le=1 << 10)]
    filled: Annotated[int, Field(strict=True, ge=0, le=1 << 10)]


class GainEntry(Entry):
    """Worst-case peak gains of a section as built: of the whole section, and of its recursion 1/A alone."""

    section: Text
    peak_gain: Rational
    recursion_gain: Rational


class OnlineSectionEntry(Entry):
    """Claims on the units of a section in on-line arithmetic.

    The digits of its result have the weights ``2**leading`` and below. A step takes digits that are `delay` places less
    significant than the one that it gives, and adds at most `increment` to the residual, in units of that digit. The
    residual has `residual_frac` fraction bits.
    """

    section: Text
    delay: Annotated[int, Field(strict=True, ge=1, le=_MAX_BITS)]
    leading: Exponent
    residual_frac: Annotated[int, Field(strict=True, ge=1, le=_MAX_BITS)]
    increment: Rational


class OnlineEntry(Entry):
    """Claims on sections in on-line arithmetic: `units` of them take turns, each a sample, `interval` clocks apart."""

    interval: Annotated[int, Field(strict=True, ge=1, le=_MAX_BITS)]
    units: Annotated[int, Field(strict=True, ge=1, le=_MAX_BITS)]
    sections: tuple[OnlineSectionEntry, ...]


class ClaimsEntry(Entry):
    """Claims, in output LSBs; gains have no unit, and `peak_gain` is that of the ideal filter.

    `settling` is the number of samples of the filter after a start from zero that are flagged, since another past could
    change their results by more than half an LSB; None without the flag. `online` is None in the other architectures.
    """

    budget: dict[Text, Rational]
    bound: Rational
    peak_gain: Rational | None
    sections: tuple[GainEntry, ...]
    settling: Annotated[int, Field(strict=True, ge=1, le=1 << 21)] | None = None
    online: OnlineEntry | None = None


class CalibrationEntry(Entry):
    """A datapath that computes the ideal polynomial of the inputs for a decimator, which takes its `output`.

    It limits nothing: its output holds the result for all inputs. Its claims are in LSBs of its output.
    """

    output: PortEntry
    stages: Annotated[tuple[StageEntry, ...], Field(min_length=1, max_length=256)]
    claims: ClaimsEntry


class FileEntry(Entry):
    """A file by its name, without a folder, and the SHA-256 of its bytes."""

    name: Text
    sha256: Sha256


class FieldEntry(Entry):
    """A quantity in a stream: its lowest bit in ``tdata``, its bits, and what a code means."""

    name: Text
    offset: Annotated[int, Field(strict=True, ge=0, le=1 << 12)]
    width: Annotated[int, Field(strict=True, ge=2, le=32)]
    signed: Annotated[bool, Field(strict=True)]
    lsb: Rational
    zero: Rational


class StreamEntry(Entry):
    """A stream: the widths of ``tdata``, ``tdest`` and ``tuser`` in bits, 0 if there is none, and the fields."""

    width: Annotated[int, Field(strict=True, ge=8, le=1 << 12)]
    dest_width: Annotated[int, Field(strict=True, ge=0, le=32)] = 0
    user_width: Annotated[int, Field(strict=True, ge=0, le=1 << 12)] = 0
    fields: Annotated[tuple[FieldEntry, ...], Field(min_length=1, max_length=2)]


_Architecture = Literal["parallel", "folded", "serial", "multiplexed", "online"]
_Code = Annotated[int, Field(strict=True, ge=-(1 << 31), lt=1 << 32)]
_Codes = tuple[_Code, _Code]
_MOST_CHANNELS = 1 << 16
_Channels = Annotated[int, Field(strict=True, ge=1, le=_MOST_CHANNELS)]
_Samples = Annotated[int, Field(strict=True, ge=1, le=1 << 12)]


class ItemEntry(Entry):
    """What the item is: everything that decides which proof its hardware needs, and that a user connects it by.

    `ahead` is the architecture of the calibration before a decimator, `samples` the number of samples of a beat, `hold`
    whether a result of a decimator leaves as often as samples enter, `reload` whether constants can be loaded, and
    `reload_lock` whether that can be locked until a reset, and `reload_registers` whether it has registers for that: a
    core without has pins for registers elsewhere. `shared` says that its hardware is a module of a chain, which
    computes several results of each sample.
    `keep` says whether the nets that have names stay through synthesis. `flags` are the bits of ``tuser`` by their
    names. `calibrated` is the lowest and the highest code of each input that is not outside the calibration, empty if
    none is; `wear` the lowest codes of the output at which the wear is a warning and critical, one pair for all
    channels or one for each, empty if wear is not judged.
    """

    core: Literal["instrument", "filter", "calibration"]
    architecture: _Architecture
    ahead: _Architecture | None = None
    channels: _Channels
    samples: _Samples
    start: Literal["zero", "steady"]
    hold: Annotated[bool, Field(strict=True)]
    protect: Literal["none", "detect", "correct"]
    reload: Annotated[bool, Field(strict=True)]
    keep: Annotated[bool, Field(strict=True)] = False
    reload_lock: Annotated[bool, Field(strict=True)] = False
    reload_registers: Annotated[bool, Field(strict=True)] = True
    shared: Annotated[bool, Field(strict=True)] = False
    flags: dict[Text, Annotated[int, Field(strict=True, ge=0, lt=64)]]
    calibrated: Annotated[tuple[_Codes, ...], Field(max_length=2)] = ()
    wear: Annotated[tuple[_Codes, ...], Field(max_length=_MOST_CHANNELS)] = ()
    taken: StreamEntry
    given: StreamEntry


class AboutEntry(Entry):
    """What the certificate is about.

    `specification` is the whole text of the specification, TOML, `sha256` that of its UTF-8 bytes, and `options` holds
    what was asked for beside it: core, realization, widths_of, board. `measurements` is the file that the calibration
    was fitted to. `item` says what the core is; without it, nothing of its hardware is proven. `files` are the files
    that were written with the certificate, and `versions` those of the tools that made them. `certificate` is the
    SHA-256 of the certificate's own text with 64 zeros in this place.
    """

    specification: LongText
    sha256: Sha256
    options: dict[Text, Text]
    measurements: FileEntry | None = None
    item: ItemEntry | None = None
    files: Annotated[tuple[FileEntry, ...], Field(max_length=100)]
    versions: dict[Text, Text]
    certificate: Sha256


class Certificate(Entry):
    """A whole certificate; `max_error` is in the unit of the output, and `about` is None without files."""

    format: Literal["sosmith certificate 2"]
    name: Text
    about: AboutEntry | None = None
    inputs: Annotated[tuple[PortEntry, ...], Field(min_length=1, max_length=2)]
    output: PortEntry
    max_error: Rational
    ideal: IdealEntry
    decimation: DecimationEntry | None = None
    downsampling: DownsamplingEntry | None = None
    stages: Annotated[tuple[StageEntry, ...], Field(min_length=1, max_length=256)]
    claims: ClaimsEntry


def sealed(certificate: Certificate) -> Certificate:
    """Return a certificate with the SHA-256 of its own text."""
    if certificate.about is None:
        return certificate
    blank = certificate.model_copy(update={"about": certificate.about.model_copy(update={"certificate": "0" * 64})})
    digest = hashlib.sha256(certificate_text(blank).encode()).hexdigest()
    return certificate.model_copy(update={"about": certificate.about.model_copy(update={"certificate": digest})})


def certificate_text(certificate: Certificate) -> str:
    """JSON text with one node per line, identical on every run."""
    return entries_text(certificate)


def entries_text(entries: Entry) -> str:
    """JSON text of a file of claims, each of the innermost lists and objects in a line."""
    return _layout(entries.model_dump(mode="json", exclude_defaults=True), "") + "\n"


def _layout(tree: Any, indent: str) -> str:
    """Break lines so that each of the innermost lists and objects has its own line."""
    inner = indent + " "
    if isinstance(tree, dict) and any(isinstance(value, dict | list) and value for value in tree.values()):
        if "op" not in tree:
            rows = [f"{inner}{json.dumps(key)}: {_layout(value, inner)}" for key, value in tree.items()]
            return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    elif isinstance(tree, list) and any(isinstance(value, dict | list) for value in tree):
        return "[\n" + ",\n".join(inner + _layout(value, inner) for value in tree) + f"\n{indent}]"
    return json.dumps(tree, ensure_ascii=False)


def read_certificate(path: Path) -> Certificate:
    """Read a certificate and check its form.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is no certificate.
    """
    return read_entries(path, Certificate)


Entries = TypeVar("Entries", bound=Entry)


def read_entries(path: Path, kind: type[Entries]) -> Entries:
    """Read a file of claims of a kind and check its form.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is no certificate.
    """
    try:
        content = read_given(path, _MAX_BYTES)
    except OSError as error:
        raise _unreadable(path, error.strerror) from None
    return entries_in(content, path, kind)


def _unreadable(path: Path, reason: str | None) -> SpecificationError:
    return SpecificationError(f"{path}: the certificate must be a file that can be read, not: {reason}")


def entries_in(content: bytes, path: Path, kind: type[Entries]) -> Entries:
    """Return the claims in the content of a file, and check their form; `path` is for messages.

    Raises
    ------
    SpecificationError
        If it is no certificate.
    """
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise _unreadable(path, "it is not UTF-8") from None
    try:
        tree = json.loads(
            text,
            object_pairs_hook=_without_duplicates,
            parse_int=_integer,
            parse_float=_refused,
            parse_constant=_refused,
        )
        return kind.model_validate(tree)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in first["loc"]).lstrip(".")
        raise SpecificationError(
            f"{path}: the file must be a certificate, not one where {place or 'the whole'} is wrong: {_said(first)}"
        ) from None
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise SpecificationError(
            f"{path}: the file must be a certificate in JSON, not text that is no JSON from {where} on"
        ) from None
    except RecursionError:
        raise SpecificationError(f"{path}: the file must be a certificate in JSON, not one nested so deep") from None
    except ValueError as error:
        raise SpecificationError(f"{path}: the file must be a certificate in JSON, not: {error}") from None


_SENTENCES = {
    "missing": "the key is missing",
    "extra_forbidden": "there is no such key",
    "model_type": "it must be an object",
    "dict_type": "it must be an object",
    "tuple_type": "it must be a list",
    "int_type": "it must be an integer",
    "bool_type": "it must be true or false",
    "string_type": "it must be a text",
    "string_unicode": "it must be a text of Unicode characters, without half of a surrogate pair",
    "string_too_long": "it must have at most {max_length} characters",
    "too_short": "it must have no fewer entries than {min_length}",
    "too_long": "it must have no more entries than {max_length}",
    "literal_error": "it must be {expected}",
    "enum": "it must be {expected}",
    "greater_than_equal": "it must be at least {ge}",
    "less_than_equal": "it must be at most {le}",
    "less_than": "it must be less than {lt}",
    "value_error": "it {error}",
}
"""Messages for validation errors, by error type; the placeholders are keys of the error's context."""


def _said(error: ErrorDetails) -> str:
    known = {key: _power(value) if isinstance(value, int) else value for key, value in error.get("ctx", {}).items()}
    sentence = _SENTENCES.get(error["type"])
    return f"it is not what is expected ({error['msg']})" if sentence is None else sentence.format(**known)


def _power(value: int) -> str:
    """Write a limit; a large one is a power of two and written as such."""
    return str(value) if abs(value) < 10**6 else f"{'-' if value < 0 else ''}2**{value.bit_length() - 1}"


def _integer(text: str) -> int:
    if len(text) > _MAX_DIGITS:
        raise ValueError(f"an integer of {len(text)} digits")
    return int(text)


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        raise ValueError("an object with the same key twice")
    return result


def _refused(text: str) -> float:
    raise ValueError(f"{text}, which is neither an integer nor a text")
