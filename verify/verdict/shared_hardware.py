"""Hardware that gives the results of several certificates, one after the other: proven for each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError, require
from sosmith.verify.multirate.ring.check import check_rings_in_turn
from sosmith.verify.multirate.ring.verdict import RingVerdict
from sosmith.verify.reader.rtlil.check import RtlilVerdict, check_rtlil
from sosmith.verify.reader.rtlil.kept import check_kept
from sosmith.verify.reader.source import read_source
from sosmith.verify.verdict.item import check_ports
from sosmith.verify.verification import Progress


@dataclass(frozen=True)
class SharedHardware:
    """What is proven of the hardware for one of the results, and of its RTLIL."""

    hardware: RingVerdict
    rtlil: RtlilVerdict


def check_shared_hardware(
    text: str, rtlil: str, name: str, certificates: Sequence[Certificate], progress: Progress
) -> list[SharedHardware]:
    """Prove that a module gives the results of certificates in turn, all of each sample; return what is proven of each.

    Parameters
    ----------
    text, rtlil : str
        SystemVerilog and RTLIL of the module.
    name : str
        Its name.
    certificates : sequence of Certificate
        Those of the results of a sample, in their order.
    progress : callable
        Called with the name of a step, the amount done and the total.

    Raises
    ------
    RejectedError
        If it computes anything else.
    """
    modules = read_source(text, name).modules
    items = []
    for certificate in certificates:
        item = None if certificate.about is None else certificate.about.item
        if item is None or certificate.downsampling is None:
            raise RejectedError(f"{certificate.name} must be one of several results that share hardware")
        require(item.shared, f"{certificate.name} must say that it shares its hardware")
        check_ports(modules[name], item)
        items.append(item)
    require(all(item == items[0] for item in items), "results that share hardware must be of the same item")
    progress("hardware of all results", 0, 0)
    verdicts = check_rings_in_turn(text, name, certificates, items[0])
    proven = check_rtlil(rtlil, modules)
    check_kept(rtlil, modules, asked=False)
    return [SharedHardware(verdict, proven) for verdict in verdicts]
