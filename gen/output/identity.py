"""The identity of the board that a core is built into, for its memory and for the host."""

from __future__ import annotations

import hashlib
from typing import Literal

from pydantic import ValidationError

from sosmith.gen.core import CoreDesign
from sosmith.gen.fpga.board_item import BoardItem, item_of
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
    design: CoreDesign | BoardItem,
    verilog: str,
    *,
    baud: int,
    clock: float,
    source: Literal["link", "converter"] = "link",
) -> Identity:
    """Return the identity of a board.

    Parameters
    ----------
    design : CoreDesign or BoardItem
        What stands in it.
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
    item = item_of(design)
    try:
        return _identity(item, verilog, baud, clock, source)
    except ValidationError as error:
        raise SpecificationError(
            f"{item.spec.path}: a board must have an identity as in docs/protocol.md, not: {first_fault(error)}"
        ) from None


def _identity(item: BoardItem, verilog: str, baud: int, clock: float, source: Literal["link", "converter"]) -> Identity:
    of_one_sample = Identity(
        protocol=VERSION,
        name=item.name,
        core=item.kind,
        sosmith=__version__,
        design=hashlib.sha256(verilog.encode()).hexdigest(),
        architecture=item.architecture,
        channels=item.spec.channels,
        sample_rate=float(item.spec.sample_rate),
        clock=float(clock),
        baud=baud,
        source=source,
        samples=1,
        inputs=tuple(_quantity(port) for port in item.inputs),
        output=_quantity(item.output),
        flags=item.flags | ({} if source == "link" else CONVERTER_FLAGS),
        reload=None if item.fingerprint is None else Reload(design=item.fingerprint, words=item.words),
    )
    of_one_sample = of_one_sample.model_copy(
        update={"samples": samples_per_message(of_one_sample.sample_bytes, of_one_sample.result_bytes)}
    )
    return of_one_sample.model_copy(update={"packed": _packed(item, of_one_sample)})


def _packed(item: BoardItem, identity: Identity) -> tuple[int, ...] | None:
    """Return the flags of packed results, if the line carries the sample rate with them, and not without."""
    needed = _ROOM * identity.sample_rate * identity.channels
    fault = {int(Flag.FAULT)} if identity.source == "converter" else set()
    flags = tuple(sorted({*item.possible} | fault))
    count = Packing(identity.output_port, flags).per_message(
        1 if identity.source == "converter" else identity.sample_bytes
    )
    plain, packed = (results_per_second(identity.baud, each) for each in (identity.samples, count))
    return flags if plain < needed <= packed else None


def _quantity(port: Port) -> Quantity:
    return (port.name, port.bits, port.signed, float(port.zero), float(port.lsb), port.unit)
