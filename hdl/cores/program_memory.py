"""The memory with a folded core's program, and the instructions in its pipeline."""

from __future__ import annotations

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory

from sosmith.hdl.check_bits import CheckBits
from sosmith.hdl.cores.folded_state import NO_COLLISIONS, Control, Position, Reload, fault_nets
from sosmith.hdl.instruction import PipelinedInstruction
from sosmith.hdl.memory_ports import read_port, write_port
from sosmith.hdl.plan.folded_clocks import pipeline_depth
from sosmith.hdl.plan.instructions import address_bits, encoded, instruction_bits
from sosmith.hdl.shell.fault_guard import FaultGuard
from sosmith.model.dataflow.program import Program

_IN_BLOCKS = {"ram_style": "block"}
"""Attribute of a memory that is wide and short: as logic it would take several times the LUT4 of all the rest."""


class ProgramMemory(NamedTuple):
    """Such a memory.

    Attributes
    ----------
    program : Program
        What it holds after a configuration.
    serial : bool
        Whether the unit multiplies by shifts and additions.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    """

    program: Program
    serial: bool
    protect: str

    def fetch(
        self,
        m: Module,
        control: Control,
        position: Position,
        reload: Reload | None,
        guard: FaultGuard | None,
    ) -> tuple[list[PipelinedInstruction], tuple[Value, Value]]:
        """Read the program; return the instructions in the pipeline stages, the one just read first.

        While words are cleared, the last one's target is the address of the next.

        Return besides whether a wrong bit was corrected at this clock, and whether one was found that could not be.

        Parameters
        ----------
        m : Module
        control : Control
        position : Position
            What is read at this clock.
        reload : Reload or None
            None if no other program can be loaded.
        guard : FaultGuard or None
            None without protection.
        """
        advance = control.advance
        codes = [encoded(instruction, self.program) for instruction in self.program.instructions]
        count = len(codes)
        if reload is not None:
            codes += [0] * ((1 << (len(codes) - 1).bit_length()) - len(codes))
            codes += [0] * len(codes)
        check = CheckBits(instruction_bits(self.program), self.protect)
        attributes = NO_COLLISIONS | ({} if self.program.products == 1 else _IN_BLOCKS)
        m.submodules.instructions = program = Memory(
            shape=check.width, depth=len(codes), init=[check.word(code) for code in codes], attrs=attributes
        )
        fetch = read_port(program, "instructions")
        index, bank = self._program_address(m, position.counter, count, reload, guard)
        m.d.comb += [fetch.addr.eq(Cat(index, bank)), fetch.en.eq(advance)]
        word = check.read(m, fetch.data, "instruction1")
        valid = Signal(name="valid1")
        looks = valid & advance if guard is None else (valid & advance) | guard.read
        fetched = Signal(len(fetch.addr), reset_less=True)
        rewrites: Value = Const(0, 1)
        if self.protect == "correct":
            with m.If(advance):
                m.d.sync += fetched.eq(fetch.addr)
            # A word that is read while it is written would be undefined.
            rewrites = looks & word.corrected & (fetched != fetch.addr)
        self._write_program(m, program, check, reload, (rewrites, fetched, word.data))
        pipeline = [PipelinedInstruction(m, "instruction1", word.data, valid, self.program)]
        with m.If(advance):
            m.d.sync += valid.eq(position.fetches)
            for k in range(2, pipeline_depth(self.program, serial=self.serial) + 1):
                code = Signal(len(word.data), name=f"instruction{k}", reset_less=True)
                valid = Signal(name=f"valid{k}")
                m.d.sync += [code.eq(pipeline[-1].code), valid.eq(pipeline[-1].valid)]
                pipeline.append(PipelinedInstruction(m, f"instruction{k}", code, valid, self.program))
            with m.If(control.clearing):  # in place of a target, the address of the word to clear
                m.d.sync += pipeline[-1].fields.target.eq(position.counter[: address_bits(self.program)])
        return pipeline, fault_nets(m, "program", looks & word.corrected, looks & word.failed)

    def _program_address(
        self,
        m: Module,
        counter: Signal,
        count: int,
        reload: Reload | None,
        guard: FaultGuard | None,
    ) -> tuple[Value, Value]:
        """Return the instruction to read, and its bank: that of the sample in work, or one that is scrubbed."""
        bits = (count - 1).bit_length()
        index: Value = counter
        bank: Value = Const(0, 0) if reload is None else reload.bank
        if guard is not None:
            index = Mux(guard.scrubs & (guard.address < count), guard.address[:bits], counter[:bits])
            if reload is not None:
                bank = Mux(guard.scrubs, reload.port.bank, bank)
        if reload is not None:
            index = Cat(index[:bits], Const(0, max(0, bits - len(index))))
        return index, bank

    def _write_program(
        self,
        m: Module,
        program: Memory,
        check: CheckBits,
        reload: Reload | None,
        rewrite: tuple[Value, Value, Value],
    ) -> None:
        """Write the idle bank from the reload port, and otherwise what was corrected."""
        rewrites, fetched, corrected = rewrite
        if reload is None and self.protect != "correct":
            return
        write = write_port(program, "instructions")
        enable, address, data = rewrites, fetched, check.written(corrected)
        if reload is not None:
            port = reload.port
            index_bits = len(write.addr) - 1
            loaded = Cat(port.write_address, Const(0, index_bits - len(port.write_address)), ~port.bank)
            if self.protect == "correct":
                enable = port.write_enable | rewrites
                address = Mux(port.write_enable, loaded, fetched)
                data = check.written(Mux(port.write_enable, port.write_data, corrected))
            else:
                enable, address, data = port.write_enable, loaded, check.written(port.write_data)
        m.d.comb += [write.addr.eq(address), write.data.eq(data), write.en.eq(enable)]
