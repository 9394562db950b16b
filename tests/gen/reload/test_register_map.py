"""The texts made of the register map say what the map says, to the tools that read them."""

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.suite.extras import needed

from sosmith.gen.reload.register_map import c_registers, markdown, systemrdl
from sosmith.model.reload.registers import (
    CRC,
    LAYOUT,
    MAGIC,
    PROTECTED_REGISTERS,
    REGISTERS,
    STATUS,
    Field,
    Outcome,
    Register,
)

RDLCompiler = needed("systemrdl").RDLCompiler
CORE = {"words": 513, "design": 0x89ABCDEF}


def in_systemrdl(folder: Path, *, protected: bool = False) -> Any:
    path = folder / "core.rdl"
    path.write_text(systemrdl("core", **CORE, protected=protected), encoding="utf-8")
    compiler = RDLCompiler()
    compiler.compile_file(str(path))
    return compiler.elaborate().top


@pytest.fixture
def compiled(tmp_path: Path) -> Any:
    return in_systemrdl(tmp_path)


@pytest.mark.parametrize(("protected", "registers"), [(False, REGISTERS), (True, PROTECTED_REGISTERS)])
def test_systemrdl_has_every_register_and_field(
    protected: bool, registers: tuple[Register, ...], tmp_path: Path
) -> None:
    compiled = in_systemrdl(tmp_path, protected=protected)
    found = [
        (
            r.inst_name,
            r.absolute_address,
            r.has_sw_readable,
            r.has_sw_writable,
            [(f.inst_name, f.low, f.width) for f in r.fields()],
        )
        for r in compiled.registers()
    ]
    assert found == [
        (r.name, r.address, r.reads, r.writes, [(f.name, f.low, f.bits) for f in r.fields] or [("VALUE", 0, 32)])
        for r in registers
    ]


def test_only_a_protected_core_has_the_counts_in_its_header() -> None:
    assert "CORE_FAULTS_UNCORRECTED_MASK" in c_registers("core", **CORE, protected=True)
    assert "FAULTS" not in c_registers("core", **CORE)


def test_systemrdl_has_constants_and_named_values(compiled: Any) -> None:
    resets = {(r.inst_name, f.inst_name): f.get_property("reset") for r in compiled.registers() for f in r.fields()}
    assert {key: value for key, value in resets.items() if value is not None} == {
        ("ID", "VALUE"): MAGIC,
        ("LAYOUT", "INTERFACE"): 1,
        ("LAYOUT", "WORDS"): 513,
        ("DESIGN", "VALUE"): 0x89ABCDEF,
    }
    outcomes = compiled.get_child_by_name("STATUS").get_child_by_name("OUTCOME").get_property("encode")
    assert {member.name: member.value for member in outcomes} == {value.name: value.value for value in Outcome}


def test_the_header_compiles_and_has_the_same_numbers(tmp_path: Path) -> None:
    (tmp_path / "core_registers.h").write_text(c_registers("core", **CORE), encoding="utf-8")
    outcome = STATUS.field("OUTCOME")
    checks = {
        "CORE_CRC_ADDRESS": CRC.address,
        "CORE_STATUS_OUTCOME_MASK": outcome.mask,
        "CORE_STATUS_OUTCOME_SHIFT": outcome.low,
        "CORE_STATUS_OUTCOME_BROKEN_OFF": Outcome.BROKEN_OFF,
        "CORE_LAYOUT_WORDS_MASK": LAYOUT.field("WORDS").mask,
        "CORE_ID": MAGIC,
        "CORE_WORDS": 513,
        "CORE_DESIGN": 0x89ABCDEF,
    }
    lines = [f'_Static_assert({name} == {int(value)}u, "{name}");' for name, value in checks.items()]
    (tmp_path / "main.c").write_text("\n".join(['#include "core_registers.h"', *lines, ""]), encoding="utf-8")
    command = ["cc", "-std=c11", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only", "main.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


def test_the_tables_name_every_register_and_field() -> None:
    cells = [line.split(" | ") for line in markdown().splitlines()]
    named = {cell.strip("` ") for row in cells for cell in row}
    assert {r.name for r in REGISTERS} | {f.name for r in REGISTERS for f in r.fields} <= named


def test_fields_must_not_overlap() -> None:
    fields = (Field("A", 0, 2, ""), Field("B", 1, 1, ""))
    with pytest.raises(ValueError, match=r"^field B of R must lie in bits 2 to 31, in ascending order$"):
        Register("R", True, False, "", fields)
    with pytest.raises(ValueError, match=r"^field A of R must lie in bits 0 to 31, in ascending order$"):
        Register("R", True, False, "", (replace(fields[0], low=31),))
