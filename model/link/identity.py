"""The identity of a board: the JSON text in its memory that says which core it has, and what its samples mean.

It is the gate for what a device says of itself: past it, every name is plain and printable, and every number is within
the range that docs/protocol.md states, so that nothing behind it has to look again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from fractions import Fraction
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import LinkError, SpecificationError
from sosmith.model.link.packing import Packing
from sosmith.model.link.protocol import BLOCK_BYTES, MAX_BODY, MAX_IDENTITY, VERSION, samples_per_message
from sosmith.model.port import Port

MAX_NAME = 64
"""Most characters of a name, as in a specification."""

MAX_UNIT = 16
"""Most characters of a unit, as in a specification."""

MIN_RATE, MAX_RATE = 1e-6, 1e12
"""Range of sample rate and clock in Hz: from a sample in 11 days to 1 THz."""

MIN_LSB, MAX_VALUE = 1e-30, 1e30
"""Smallest LSB, and the largest LSB and amount of a zero, in the unit of the port: sums and products stay finite."""


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("Text should be printable")
    return text


Name = Annotated[str, Field(pattern=f"^[A-Za-z_][A-Za-z0-9_]{{0,{MAX_NAME - 1}}}$")]
Unit = Annotated[str, Field(max_length=MAX_UNIT), AfterValidator(_printable)]
Release = Annotated[str, Field(pattern=f"^[A-Za-z0-9.+_-]{{1,{MAX_NAME}}}$")]
Count = Annotated[int, Field(ge=1, lt=1 << 32)]
Word = Annotated[int, Field(ge=0, lt=1 << 32)]
Bits = Annotated[int, Field(ge=2, le=32)]
Bit = Annotated[int, Field(ge=0, le=7)]
Rate = Annotated[float, Field(ge=MIN_RATE, le=MAX_RATE)]
Step = Annotated[float, Field(ge=MIN_LSB, le=MAX_VALUE)]
Offset = Annotated[float, Field(ge=-MAX_VALUE, le=MAX_VALUE)]
Quantity = tuple[Name, Bits, bool, Offset, Step, Unit]
"""Name, bits, signed, zero, LSB and unit of a port."""


CONVERTER_FLAGS = {Flag.FAULT.name.lower(): int(Flag.FAULT)}
"""Bits of the flags that a board with converters has beside those of its core."""


class Reload(BaseModel):
    """The registers of a core: the fingerprint that a set of coefficients must be made for, and its words."""

    model_config = ConfigDict(frozen=True, strict=True, extra="ignore")

    design: Word
    words: Count


class Identity(BaseModel):
    """What a board is.

    Attributes
    ----------
    protocol : int
        Version of the protocol.
    name, core : str
        Name of the core, and which part of the specification it is.
    sosmith : str
        Version of sosmith that it was made with.
    design : str
        SHA-256 of the core's SystemVerilog, in hexadecimal digits.
    architecture : str
        Name of the architecture.
    channels : int
        Number of channels.
    sample_rate : float
        Samples of a channel in a second.
    clock : float
        Clock of the core in Hz.
    baud : int
        Rate of the line, in bits per second.
    source : str
        ``link`` if samples come over the link, ``converter`` if the board takes them itself.
    samples : int
        Most samples in one message.
    inputs : tuple of tuple
        Name, bits, signed, zero, LSB and unit of each field of a sample.
    output : tuple
        The same of a result.
    flags : dict of str to int
        Bit of each flag of a result's status.
    reload : Reload or None
        The registers of a core that can load coefficients.
    results : int
        Results for each sample: more than 1 behind a chain that interpolates.
    packed : tuple of int or None
        Bits of the status that packed results have, in increasing order; None if the board packs none.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="ignore")

    protocol: Annotated[int, Field(ge=VERSION, le=VERSION)]
    name: Name
    core: Name
    sosmith: Release
    design: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    architecture: Name
    channels: Annotated[int, Field(ge=1, le=256)]
    sample_rate: Rate
    clock: Rate
    baud: Count
    source: Literal["link", "converter"]
    samples: Annotated[int, Field(ge=1, le=255)]
    inputs: Annotated[tuple[Quantity, ...], Field(min_length=1, max_length=16)]
    output: Quantity
    flags: dict[Name, Bit]
    reload: Reload | None
    results: Annotated[int, Field(ge=1, le=MAX_BODY - 1)] = 1
    packed: tuple[Bit, ...] | None = None

    @model_validator(mode="after")
    def _each_once(self) -> Identity:
        if len({quantity[0] for quantity in self.inputs}) < len(self.inputs):
            raise ValueError("Names of inputs should differ")
        if len(set(self.flags.values())) < len(self.flags):
            raise ValueError("Bits of flags should differ")
        if self.source == "converter" and not CONVERTER_FLAGS.keys() <= self.flags.keys():
            raise ValueError("Flags of a device with converters should have fault")
        if self.packed is not None and self.packed != tuple(sorted({*self.packed} & {*self.flags.values()})):
            raise ValueError("Packed flags should be bits of flags, in increasing order")
        if self.results > 1 and (self.packed is not None or self.source == "converter"):
            raise ValueError("Several results for each sample should be plain, of a device that is fed over the link")
        return self

    @property
    def digest(self) -> str:
        """Twelve hexadecimal digits that are others for another identity."""
        return hashlib.sha256(self.memory).hexdigest()[:12]

    @property
    def input_ports(self) -> tuple[Port, ...]:
        """The fields of a sample."""
        return tuple(_port(quantity) for quantity in self.inputs)

    @property
    def output_port(self) -> Port:
        """The field of a result."""
        return _port(self.output)

    @property
    def sample_bytes(self) -> int:
        """Bytes of a sample on the link."""
        return sum(port.bytes for port in self.input_ports)

    @property
    def result_bytes(self) -> int:
        """Bytes of a result on the link, with its status."""
        return self.output_port.bytes + 1

    @property
    def result_rate(self) -> float:
        """Results of a channel in a second."""
        return self.sample_rate * self.results

    @property
    def packing(self) -> Packing | None:
        """The form of packed results; None if the board packs none."""
        return None if self.packed is None else Packing(self.output_port, self.packed)

    @property
    def memory(self) -> bytes:
        """Content of the board's memory: the text and zero bytes, as many as make the length a power of two.

        Raises
        ------
        SpecificationError
            If the text is too long, as it is for very long names.
        """
        left_out = {"results"} if self.results == 1 else set()
        about = self.model_dump(mode="json", exclude=left_out | ({"packed"} if self.packed is None else set()))
        text = json.dumps(about, ensure_ascii=False, separators=(",", ":")).encode()
        if len(text) >= MAX_IDENTITY:
            raise SpecificationError(
                f"the identity of the board must have fewer than {MAX_IDENTITY} bytes, not {len(text)}; "
                "shorter names of core, inputs and units help"
            )
        return text.ljust(max(1 << len(text).bit_length(), BLOCK_BYTES), b"\0")

    @staticmethod
    def of_memory(memory: bytes) -> Identity:
        """Read the identity from a board's memory, or from as much of it as ends with a zero byte.

        Raises
        ------
        LinkError
            If it is no identity, or one that contradicts itself.
        """
        text = memory.split(b"\0", 1)[0]
        try:
            identity = Identity.model_validate_json(text)
        except ValidationError as error:
            raise LinkError(
                f"the board's identity must be the JSON of docs/protocol.md, not: {first_fault(error)}"
            ) from None
        json.loads(text, object_pairs_hook=_each_key_once)
        fitting = samples_per_message(identity.sample_bytes, identity.results * identity.result_bytes)
        if identity.samples > fitting:
            raise LinkError(
                f"the board's identity must have at most {fitting} samples in a message, not {identity.samples}"
            )
        return identity


def first_fault(error: ValidationError) -> str:
    """Return the first thing that is wrong with an identity; what stands there itself is shown in plain ASCII."""
    first = error.errors(include_url=False, include_input=False)[0]
    place = _plain(".".join(map(str, first["loc"]))) or "text"
    return f"{place}: {first['msg'].removeprefix('Value error, ')}"


def _each_key_once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise LinkError(f"the board's identity must have each key once, not {_plain(key)} twice")
        table[key] = value
    return table


def _plain(text: str) -> str:
    return ascii(text[:MAX_NAME])[1:-1]


def _port(quantity: Quantity) -> Port:
    name, bits, signed, zero, lsb, unit = quantity
    return Port(name=name, bits=bits, signed=signed, lsb=Fraction(lsb), zero=Fraction(zero), unit=unit)
