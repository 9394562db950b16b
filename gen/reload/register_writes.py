"""The register writes that load a set of constants into a core, as a list and as JSON."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any

from sosmith.gen.core import CoreDesign
from sosmith.gen.proof.fading import RESIDUE
from sosmith.gen.reload.reload import OtherSet, Swap
from sosmith.model.reload.registers import CRC, DATA, VERSION, Register


def register_writes(hardware: CoreDesign, new_set: OtherSet, version: int) -> list[tuple[Register, int]]:
    """List the register writes, in order, that make a core switch to a set.

    Parameters
    ----------
    hardware : CoreDesign
        Design of the core.
    new_set : OtherSet
        The set, as `check_swap` returns it.
    version : int
        Value of ``VERSION`` once the set is active, 32 bits.
    """
    return writes_of(words_of(hardware, new_set), version)


def words_of(hardware: CoreDesign, new_set: OtherSet) -> list[int]:
    """Return the words of a bank of a core for a set."""
    return hardware.architecture.bank(new_set.quantized.datapath, new_set.program)


def writes_of(words: Sequence[int], version: int) -> list[tuple[Register, int]]:
    """List the register writes that load words: of a bank, or of the banks of several cores that share registers."""
    if not 0 <= version < 1 << 32:
        raise ValueError(f"version must be in 0..4294967295, not {version}")
    crc = zlib.crc32(b"".join(word.to_bytes(4, "little") for word in (version, *words)))
    return [(VERSION, version), *((DATA, word) for word in words), (CRC, crc)]


def reload_json(hardware: CoreDesign, swap: Swap, version: int) -> dict[str, Any]:
    """Return what a host needs to load a set, and what is proven about it, as JSON values.

    ``writes`` is a list of pairs of a byte address and a word, in order; errors are in the output's unit. `calibration`
    has the set's exact polynomial, as fractions, and `zero_frequency_gain` that of its filter: what a steady result is.
    """
    output, quantized = hardware.datapath.output, swap.new_set.quantized
    polynomial = quantized.polynomial
    words, _ = hardware.architecture.bank_size
    return {
        "name": hardware.spec.name,
        "design": hardware.architecture.fingerprint,
        "version": version,
        "words": words,
        "error_bound": float(quantized.bound * output.lsb),
        "error_parts": {part: float(value * output.lsb) for part, value in quantized.budget.items()},
        "error_unit": output.unit,
        "restarts": hardware.architecture.restarts,
        "transient_samples": swap.samples * quantized.samples_of_input,
        "error_after_transient": float((quantized.bound + (RESIDUE if swap.samples else 0)) * output.lsb),
        "state_use": float(swap.use),
        "calibration": None if polynomial is None else [[str(a) for a in row] for row in polynomial.coefficients],
        "zero_frequency_gain": 1.0 if quantized.filter is None else quantized.filter.dc_gain,
        "writes": pairs_of(register_writes(hardware, swap.new_set, version)),
    }


def pairs_of(writes: Sequence[tuple[Register, int]]) -> list[list[int]]:
    """Return register writes as pairs of a byte address and a word."""
    return [[register.address, word] for register, word in writes]
