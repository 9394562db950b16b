"""The register map of a reloadable core as Markdown, C header and SystemRDL, all from one description."""

from __future__ import annotations

from sosmith.model.reload.registers import (
    BITS,
    DESIGN,
    ID,
    INTERFACE,
    LAYOUT,
    MAGIC,
    Register,
    registers_of,
)
from sosmith.model.templates import render


def markdown() -> str:
    """Return the tables of the registers of a protected core with a lock, and of their fields."""
    registers = registers_of(protected=True, lock=True)
    rows = ["| address | register | access | meaning |", "|---|---|---|---|"]
    rows += [f"| 0x{r.address:02X} | `{r.name}` | {_access(r)} | {r.text} |" for r in registers]
    rows += ["", "| register | bits | field | meaning |", "|---|---|---|---|"]
    for register in registers:
        for field in register.fields:
            top = field.low + field.bits - 1
            bits = f"{top}" if field.bits == 1 else f"{top} to {field.low}"
            values = ", ".join(f"{value.value} {value.name}" for value in field.values or ())
            text = f"{field.text[:-1]}: {values}." if values else field.text
            rows.append(f"| `{register.name}` | {bits} | `{field.name}` | {text} |")
    return "".join(f"{row}\n" for row in rows)


def c_registers(name: str, *, words: int, design: int, protected: bool = False, lock: bool = False) -> str:
    """Return a C header with addresses, fields and constants of the core `name`.

    Parameters
    ----------
    name : str
        Name of the core.
    words : int
        Number of words in a bank.
    design : int
        Fingerprint of the design.
    protected : bool
        Whether the core counts faults.
    lock : bool
        Whether the core can be locked.
    """
    registers = registers_of(protected=protected, lock=lock)
    constants = {"ID": MAGIC, "INTERFACE": INTERFACE, "WORDS": words, "DESIGN": design}
    return render(
        __package__, "registers.h.jinja", name=name, prefix=name.upper(), registers=registers, constants=constants
    )


def systemrdl(name: str, *, words: int, design: int, protected: bool = False, lock: bool = False) -> str:
    """Return the registers in SystemRDL 2.0, for other tools; parameters as for `c_registers`."""
    registers = registers_of(protected=protected, lock=lock)
    layout = INTERFACE << LAYOUT.field("INTERFACE").low | words << LAYOUT.field("WORDS").low
    constants = {ID.name: MAGIC, LAYOUT.name: layout, DESIGN.name: design}
    return render(__package__, "registers.rdl.jinja", name=name, bits=BITS, registers=registers, constants=constants)


def _access(register: Register) -> str:
    return " and ".join([*["read"] * register.reads, *["write"] * register.writes])
