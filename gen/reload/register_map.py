"""The registers of a reloadable core as texts: Markdown, C header, SystemRDL, all from the one description."""

from __future__ import annotations

from sosmith.hdl.axi_lite import BITS
from sosmith.model.reload.registers import DESIGN, ID, INTERFACE, LAYOUT, MAGIC, REGISTERS, Register


def markdown() -> str:
    """Return the tables of the registers and of their fields."""
    rows = ["| address | register | access | meaning |", "|---|---|---|---|"]
    rows += [f"| 0x{r.address:02X} | `{r.name}` | {_access(r)} | {r.text} |" for r in REGISTERS]
    rows += ["", "| register | bits | field | meaning |", "|---|---|---|---|"]
    for register in REGISTERS:
        for field in register.fields:
            top = field.low + field.bits - 1
            bits = f"{top}" if field.bits == 1 else f"{top} to {field.low}"
            values = ", ".join(f"{value.value} {value.name}" for value in field.values or ())
            text = f"{field.text[:-1]}: {values}." if values else field.text
            rows.append(f"| `{register.name}` | {bits} | `{field.name}` | {text} |")
    return "".join(f"{row}\n" for row in rows)


def c_registers(name: str, *, words: int, design: int) -> str:
    """Return a C header with addresses, fields and constants of the core `name`.

    Parameters
    ----------
    name : str
        Name of the core.
    words : int
        Words of a bank.
    design : int
        Fingerprint.
    """
    prefix = name.upper()
    lines = [f"#define {prefix}_{r.name}_ADDRESS 0x{r.address:02X}u" for r in REGISTERS]
    for register in REGISTERS:
        for field in register.fields:
            label = f"{prefix}_{register.name}_{field.name}"
            lines += ["", f"/* {field.text} */"]
            lines += [f"#define {label}_SHIFT {field.low}", f"#define {label}_MASK 0x{field.mask:08X}u"]
            lines += [f"#define {label}_{value.name} {value.value}u" for value in field.values or ()]
    values = {"ID": MAGIC, "INTERFACE": INTERFACE, "WORDS": words, "DESIGN": design}
    lines += ["", "/* What a core must read to be this one. */"]
    lines += [f"#define {prefix}_{key} 0x{value:X}u" for key, value in values.items()]
    body = "\n".join(lines)
    return f"""/* {name}: registers of the AXI4-Lite port that reloads it, made by sosmith. */
#ifndef {prefix}_REGISTERS_H
#define {prefix}_REGISTERS_H

{body}

#endif
"""


def systemrdl(name: str, *, words: int, design: int) -> str:
    """Return the registers in SystemRDL 2.0, for tools that make other things from it; parameters as `c_registers`."""
    layout = INTERFACE << LAYOUT.field("INTERFACE").low | words << LAYOUT.field("WORDS").low
    constants = {ID.name: MAGIC, LAYOUT.name: layout, DESIGN.name: design}
    blocks = [_rdl_register(register, constants.get(register.name)) for register in REGISTERS]
    body = "\n".join(f"    {line}".rstrip() for block in blocks for line in block)
    return f"""addrmap {name}_registers {{
    name = "{name}";
    desc = "Registers of the AXI4-Lite port that reloads it, made by sosmith.";
    default regwidth = {BITS};
    default accesswidth = {BITS};

{body}
}};
"""


def _access(register: Register) -> str:
    return " and ".join([*["read"] * register.reads, *["write"] * register.writes])


def _rdl_register(register: Register, constant: int | None) -> list[str]:
    software = "rw" if register.reads and register.writes else "r" if register.reads else "w"
    hardware = "na" if constant is not None else "rw" if software == "rw" else "w" if register.reads else "r"
    lines = []
    for field in register.fields:
        if field.values:
            members = " ".join(f"{value.name} = {value.value};" for value in field.values)
            lines.append(f"enum {register.name}_{field.name} {{ {members} }};")
    text = register.text.replace('"', '\\"')
    lines += ["reg {", f'    desc = "{text}";', f"    default sw = {software};", f"    default hw = {hardware};"]
    for field in register.fields:
        reset = "" if constant is None else f" = 0x{field.of(constant):X}"
        encode = f" encode = {register.name}_{field.name};" if field.values else ""
        span = f"[{field.low + field.bits - 1}:{field.low}]"
        lines.append(f'    field {{ desc = "{field.text}";{encode} }} {field.name}{span}{reset};')
    if not register.fields:
        reset = "" if constant is None else f" = 0x{constant:X}"
        lines.append(f"    field {{}} VALUE[{BITS - 1}:0]{reset};")
    return [*lines, f"}} {register.name} @ 0x{register.address:X};", ""]
