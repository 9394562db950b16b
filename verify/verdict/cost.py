"""The cost in a manifest: operators, each counted once, by what a certificate says and what the hardware has.

The sizes of multipliers, in the order of the graphs, leave out products by constants that are made of adders, whose
sums are among the bits of adders. Which products these are, and what sums there are, is read in the hardware of a
parallel core. A program has no hardware for each operator, nor have multipliers or sections that take turns: there
every product counts as a multiplier. Integrators and combs count in place of the filter that they make.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sosmith.verify.certificate_file import Certificate, ItemEntry, StageEntry
from sosmith.verify.multirate.decimating.cic import CicVerdict
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.verdict.operators import operators
from sosmith.verify.verdict.products import products_of
from sosmith.verify.verdict.scope import Proofs

_PROGRAMS = frozenset({"folded", "serial"})
_SHARED = _PROGRAMS | {"multiplexed"}


def cost_of(certificate: Certificate, item: ItemEntry, proofs: Proofs, stated: Mapping[str, Any]) -> Any:
    """Return the cost that a manifest must state, which `stated` is; None where that is not known.

    A product by a power of two takes wires only: it may be among the multipliers or not.
    """
    parts = _parts(certificate, item, proofs)
    if item.architecture == "online":
        return None
    if isinstance(proofs.hardware, CicVerdict):
        output = operators(certificate.stages[1:])
        return {
            "multipliers": output.products,
            "adder_bits": proofs.hardware.adder_bits + output.adder_bits,
            "register_bits": proofs.hardware.register_bits + output.register_bits,
        }
    everything = operators([stage for stages, _ in parts for stage in stages])
    whole = {
        "multipliers": everything.products,
        "adder_bits": everything.adder_bits,
        "register_bits": everything.register_bits,
    }
    if item.architecture in _SHARED or certificate.downsampling is not None:
        return whole
    products: list[tuple[list[int], bool | None]] = []
    adder_bits = everything.adder_bits
    for stages, verdict in parts:
        made = None if verdict is None or verdict.reading is None else products_of(verdict.reading)
        if made is None:
            return whole if stated["multipliers"] == whole["multipliers"] else None
        adder_bits += made.adder_bits
        products += zip(operators(stages).products, made.multiplied, strict=True)
    return whole | {"multipliers": _as_stated(products, stated["multipliers"]), "adder_bits": adder_bits}


def _parts(
    certificate: Certificate, item: ItemEntry, proofs: Proofs
) -> list[tuple[Sequence[StageEntry], HardwareVerdict | None]]:
    """Return the stages that count, each with the proof of the hardware that computes them."""
    own = (certificate.stages, proofs.hardware)
    calibration = None if certificate.decimation is None else certificate.decimation.calibration
    if calibration is None or (item.architecture not in _PROGRAMS and item.ahead in _PROGRAMS):
        return [own]
    ahead = proofs.calibration if isinstance(proofs.calibration, HardwareVerdict) else None
    return [(calibration.stages, ahead), own]


def _as_stated(products: Sequence[tuple[list[int], bool | None]], stated: Sequence[list[int]]) -> Sequence[list[int]]:
    """Return the stated sizes of multipliers if they are right: those of all that must be there, some that may be."""
    places = {0}
    for size, multiplied in products:
        next_to = {place + 1 for place in places if [*stated[place : place + 1]] == [size]}
        places = {place for place in places if multiplied is not True} | (next_to if multiplied is not False else set())
    return stated if len(stated) in places else [size for size, multiplied in products if multiplied]
