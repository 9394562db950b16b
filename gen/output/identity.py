"""The identity of the board that a core is built into, for its memory and for the host."""

from __future__ import annotations

import hashlib
from typing import Literal

from pydantic import ValidationError

from sosmith.gen.core import CoreDesign, refuse_decimated_channels
from sosmith.gen.output.core_facts import interface_facts
from sosmith.gen.reload.register_writes import bank_size
from sosmith.gen.version import __version__
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity, Quantity, Reload, first_fault
from sosmith.model.link.packing import Packing
from sosmith.model.link.protocol import VERSION, results_per_second, samples_per_message
from sosmith.model.port import Port

_ROOM = 1.1
"""What of the line must be free for other requests, as a factor of what results need."""


def identity(
    design: CoreDesign, verilog: str, *, baud: int, clock: float, source: Literal["link", "converter"] = "link"
) -> Identity:
    """Return the identity of a board.

    Parameters
    ----------
    design : CoreDesign
        The core.
    verilog : str
        Its SystemVerilog, as `generated` gives it.
    baud : int
        Rate of the line, in bits per second.
    clock : float
        Clock of the core in Hz.
    source : str
        Where samples come from.

    Raises
    ------
    SpecificationError
        If beats of the core hold several samples, there is not a result for each sample, or a host would refuse the
        identity, as it does with a rate or an LSB outside the ranges of docs/protocol.md.
    """
    _check(design)
    try:
        return _identity(design, verilog, baud, clock, source)
    except ValidationError as error:
        raise SpecificationError(
            f"{design.spec.path}: a board must have an identity as in docs/protocol.md, not: {first_fault(error)}"
        ) from None


def _identity(
    design: CoreDesign, verilog: str, baud: int, clock: float, source: Literal["link", "converter"]
) -> Identity:
    datapath, fingerprint = design.datapath, design.architecture.fingerprint
    words, _ = (0, 0) if fingerprint is None else bank_size(design.architecture)
    of_one_sample = Identity(
        protocol=VERSION,
        name=datapath.name,
        core=design.core,
        sosmith=__version__,
        design=hashlib.sha256(verilog.encode()).hexdigest(),
        architecture=design.architecture.name,
        channels=design.spec.channels,
        sample_rate=float(design.spec.sample_rate),
        clock=float(clock),
        baud=baud,
        source=source,
        samples=1,
        inputs=tuple(_quantity(port) for port in datapath.inputs),
        output=_quantity(datapath.output),
        flags=dict(interface_facts(design).outputs.flags) | ({} if source == "link" else CONVERTER_FLAGS),
        reload=None if fingerprint is None else Reload(design=fingerprint, words=words),
    )
    of_one_sample = of_one_sample.model_copy(
        update={"samples": samples_per_message(of_one_sample.sample_bytes, of_one_sample.result_bytes)}
    )
    return of_one_sample.model_copy(update={"packed": _packed(design, of_one_sample)})


def _packed(design: CoreDesign, identity: Identity) -> tuple[int, ...] | None:
    """Return the flags of packed results, if the line carries the sample rate with them, and not without."""
    needed = _ROOM * identity.sample_rate * identity.channels
    flags = _possible(design, identity.source)
    count = Packing(identity.output_port, flags).per_message(
        1 if identity.source == "converter" else identity.sample_bytes
    )
    plain, packed = (results_per_second(identity.baud, each) for each in (identity.samples, count))
    return flags if plain < needed <= packed else None


def _possible(design: CoreDesign, source: str) -> tuple[int, ...]:
    """Bits of the flags that a result can have: with registers, any."""
    datapath = design.datapath
    if design.architecture.fingerprint is not None:
        return tuple(int(flag) for flag in Flag)
    ranges = zip(datapath.inputs, datapath.calibrated, strict=True)
    can = {
        Flag.INPUT_AT_RAIL: True,
        Flag.OUTSIDE_CALIBRATION: any((port.lowest, port.highest) != limits for port, limits in ranges),
        Flag.OUTPUT_SATURATED: True,
        Flag.WEAR_WARNING: bool(datapath.wear),
        Flag.WEAR_CRITICAL: bool(datapath.wear),
        Flag.SETTLING: datapath.settles,
        Flag.FAULT: source == "converter" or design.spec.hardware.protect != "none",
    }
    return tuple(int(flag) for flag in Flag if can[flag])


def _check(design: CoreDesign) -> None:
    """Check that a core takes one sample at a time, and has a result for each."""
    refuse_decimated_channels(design, "on a board")
    lanes, factor = design.architecture.samples_per_clock, design.datapath.samples_per_result
    if lanes > 1:
        raise SpecificationError(
            f"{design.spec.path}: hardware.samples_per_clock must be 1 on a board, whose serial line never brings "
            f"several samples a clock, not {lanes}"
        )
    if factor > 1 and not design.architecture.hold:
        raise SpecificationError(
            f"{design.spec.path}: filter.hold must be true with filter.decimate = {factor} on a board, which "
            "returns a result for each sample, not false"
        )


def _quantity(port: Port) -> Quantity:
    return (port.name, port.bits, port.signed, float(port.zero), float(port.lsb), port.unit)
