"""What every architecture of a datapath's hardware has: its terms, its plan of clocks, its size, and its component."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from sosmith.gen.architectures.blocks import NO_LIMIT, Blocks
from sosmith.gen.architectures.fingerprint import fingerprint
from sosmith.gen.fpga.boards import Board
from sosmith.gen.specification.combinations import Terms
from sosmith.gen.word_lengths.cost import Cost, cost_of_graphs, products_from_adders
from sosmith.gen.word_lengths.objective import Objective
from sosmith.hdl.plan import decimator_clocks
from sosmith.hdl.plan.look_ahead import Products
from sosmith.hdl.plan.unfolding import unfolded_stages
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator
from sosmith.model.dataflow.graph import Graph
from sosmith.model.dataflow.program import Program
from sosmith.model.errors import ShortfallError
from sosmith.model.reload.constants import constants, packed, values_of
from sosmith.model.reload.registers import BITS
from sosmith.model.sections.online import OnlineSchedule

if TYPE_CHECKING:
    from amaranth.lib.wiring import Component

DIGIT_BITS = 15
"""Width of a digit without a board: factors of 16 bits, a sign included, suit every multiplier block that is known."""


@dataclass(frozen=True)
class Architecture(ABC):
    """A datapath and the hardware that an architecture makes of it.

    Attributes
    ----------
    terms : Terms
        Of the class: its name, and which specifications it takes.
    checked : str
        Of the class: what `sosmith verify --files` proves of a core with fixed constants and no protection, a sentence.
    is_filled : bool
        Of the class: whether what it remembers is filled with the first sample of a steady start, or with zeros,
        instead of a start beside the sections.
    least_clocks : int
        Of the class: fewest clocks for each result that any of its cores takes.
    shares_sections : bool
        Of the class: whether sections of the same structure share hardware, and so have the same formats.
    datapath : Datapath
        The datapath.
    channels : int
        Number of channels.
    reload : bool
        Whether constants can be loaded at run time.
    protect : str
        One of `sosmith.model.dataflow.protection.PROTECTIONS`.
    digit_bits : int
        Width of a digit of the program, one bit less than a factor of the multiplier; less if an instruction must fit
        a register to be loadable.
    blocks : Blocks
        Multiplier blocks that there are.
    samples_per_clock : int
        Samples in a beat of the streams; more than one in the parallel architecture only.
    look_ahead : bool
        Whether the loops of the parallel architecture, which go back several samples, are pipelined through those
        between. All products by constants are then made of adders.
    hold : bool
        Whether each result behind a decimator is handed out once for each of its samples.
    calibration : Architecture or None
        Hardware of the calibration before a decimator; None without one.
    reload_lock : bool
        Whether loading can be locked until a reset.
    reload_registers : bool
        Whether there are registers for that; otherwise pins, for registers elsewhere.
    clock : float
        The clock that it is made for, in Hz; 0 if none is known.
    available : int
        Clocks that there are for each result; 0 if that is not known.
    """

    terms: ClassVar[Terms]
    checked: ClassVar[str]
    is_filled: ClassVar[bool] = False
    least_clocks: ClassVar[int] = 1
    shares_sections: ClassVar[bool] = False

    datapath: Datapath
    channels: int = 1
    reload: bool = False
    protect: str = "none"
    digit_bits: int = DIGIT_BITS
    blocks: Blocks = NO_LIMIT
    samples_per_clock: int = 1
    look_ahead: bool = False
    hold: bool = False
    calibration: Architecture | None = None
    reload_lock: bool = False
    reload_registers: bool = True
    clock: float = 0.0
    available: int = 0

    @classmethod
    @abstractmethod
    def is_tried(cls, blocks: Blocks) -> bool:
        """Say whether an automatic choice tries it, where there are so many multiplier blocks."""

    @classmethod
    @abstractmethod
    def objective(cls, board: Board | None, *, adders: bool = False, blocks: Blocks = NO_LIMIT) -> Objective:
        """Return what word lengths and a realization are chosen for.

        `adders` says that no product by a constant may take a multiplier block, where each product has its own;
        `blocks`, which multiplier blocks there are.
        """

    @classmethod
    def digit_bits_on(cls, board: Board | None) -> int:
        """Width of a digit, where there is a program: by the multiplier block of the board if it takes one."""
        del board
        return DIGIT_BITS

    @classmethod
    def products_with(cls, blocks: Blocks) -> int:
        """Return the products that a shared unit computes at a clock, with as many multiplier blocks."""
        del blocks
        return 1

    @property
    def name(self) -> str:
        """As in the specification."""
        return self.terms.name

    @classmethod
    def measured_as(cls) -> str:
        """Return the name of the architecture whose synthesized cores say what its operators take."""
        return cls.terms.name

    @property
    def has_module(self) -> bool:
        """Whether its files have hardware: that of a result of several may stand with the others'."""
        return True

    @property
    def program(self) -> Program | None:
        """Program of a shared unit; None without one.

        Raises
        ------
        ShortfallError
            If the datapath cannot be folded.
        """
        return None

    @property
    def online(self) -> OnlineSchedule | None:
        """Clocks of units that work on digits; None without them.

        Raises
        ------
        ShortfallError
            If a section is not one for on-line arithmetic.
        """
        return None

    @property
    def decimator(self) -> Decimator | None:
        """What stands before the datapath's first stage; None if all samples go in."""
        return self.datapath.decimator

    @property
    def copies_per_result(self) -> int:
        """Times that each result is handed out."""
        return self.decimator.factor if self.hold and self.decimator is not None else 1

    @property
    def restarts(self) -> bool:
        """Whether the hardware restarts with constants that are loaded."""
        return self.reload and self.datapath.restarts

    @cached_property
    def fingerprint(self) -> int | None:
        """CRC-32 of everything about the hardware except its constants: sets are loadable if this is equal.

        None if the hardware is not reloadable.
        """
        if not self.reload:
            return None
        return fingerprint(
            self.name, self.datapath, self.channels, self.program, protect=self.protect, restarts=self.restarts
        )

    # Constants that are loaded.

    @property
    def bank_size(self) -> tuple[int, int]:
        """Number of words in a bank of constants, and the number of bits used in each."""
        return sum(constant.words for constant in constants(self.datapath)), BITS

    @property
    def has_registers(self) -> bool:
        """Whether constants are loaded through registers of its own."""
        return self.reload and self.reload_registers

    @property
    def bank_pins(self) -> tuple[int, int] | None:
        """Number of words in a bank and of bits in each, where constants are loaded at pins; None otherwise."""
        return self.bank_size if self.reload and not self.reload_registers else None

    def check_registers(self) -> None:
        """Check that a word of a bank fits a register.

        Raises
        ------
        ShortfallError
            If it does not.
        """
        _, bits = self.bank_size
        if bits > BITS:
            raise ShortfallError(
                f"a constant that can be loaded must have at most {BITS} bits, not {bits}: raise output.max_error"
            )

    def bank(self, datapath: Datapath, program: Program | None) -> list[int]:
        """Return the words of a bank for a datapath of the same structure, and its program if there is one.

        Raises
        ------
        ShortfallError
            If they do not fit the hardware.
        """
        del program
        loadable = constants(self.datapath)
        return packed(values_of(datapath, loadable), loadable)

    # Size.

    @property
    def least_blocks(self) -> tuple[int, str]:
        """Fewest multiplier blocks that it takes, and for what, half a sentence; 0 where adders make all products."""
        return 0, ""

    def check_blocks(self) -> None:
        """Check that there are multiplier blocks enough, where there are any.

        Raises
        ------
        ShortfallError
            If there are too few.
        """
        (needed, why), there = self.least_blocks, self.blocks
        if there.asked is not None and needed > there.asked:
            raise ShortfallError(f"hardware.multipliers must be at least {needed} {why}, not {there.asked}")
        if there.available and needed > there.available:
            raise ShortfallError(
                f"the board must have at least {needed} multiplier blocks {why}, not {there.available}"
            )

    @cached_property
    def graphs(self) -> list[Graph]:
        """What stages with hardware for each operation compute at a clock."""
        return [stage.graph for stage in unfolded_stages(self.datapath, self.samples_per_clock)]

    @cached_property
    def adders(self) -> tuple[frozenset[int], ...]:
        """Products by constants that are made of adders, by stage: for which there are no multiplier blocks left.

        With several samples a clock, those of the unfolded stages. None of them if the constants can be loaded, and
        where products share a unit.
        """
        return products_from_adders(self.graphs, None, self.blocks.bits)

    @property
    def products(self) -> Products | None:
        """How products by constants are made with look-ahead; None without."""
        return None

    @property
    def _own_cost(self) -> Cost:
        """Operators of what is computed at a clock."""
        return cost_of_graphs(self.graphs, self.adders)

    @property
    def cost(self) -> Cost:
        """Operators before synthesis, where a program would run as if each had its own hardware; no decimator's.

        Those of a calibration before a decimator are among them, unless that alone has a program.
        """
        own = self._own_cost
        apart = self.calibration is None or (self.program is None and self.calibration.program is not None)
        return own if self.calibration is None or apart else self.calibration.cost.beside(own)

    @property
    def multiplier_blocks(self) -> int:
        """Multiplier blocks that it takes, without what stands before a decimator."""
        return sum(product.blocks_of(self.blocks.bits) for product in self._own_cost.multiplications)

    @property
    def memory_bits(self) -> int | None:
        """Bits of memory, with those of what stands before a decimator; None if nothing has any."""
        programs = [each.program for each in (self.calibration, self) if each is not None and each.program is not None]
        return sum(each.words * (each.digit_bits + 1) for each in programs) if programs else None

    # Clocks. Those with an underscore are of what stands behind a decimator alone.

    @property
    @abstractmethod
    def _latency_cycles(self) -> int:
        """Clocks from the edge that accepts a sample to the edge that can output it."""

    @property
    @abstractmethod
    def _cycles_per_sample(self) -> int:
        """Clocks between samples at the highest rate."""

    @property
    def _cleared_cycles(self) -> int:
        """Clocks after a reset until the first sample is accepted, while memories are cleared."""
        return 0

    @property
    def _taken_cycles(self) -> int:
        """Clocks from the edge that finds a sample to the one that accepts it; 0 if it is accepted at once.

        An upper limit in serial.
        """
        return 0

    @property
    def latency_cycles(self) -> int:
        """Most clocks from the edge that accepts a sample to the edge that can output its result.

        If neither the sample nor the result waits for another one, or for the sink. Behind a decimator the first sample
        may be accepted while memories are still cleared, which is among them.
        """
        if self.decimator is None:
            return self._latency_cycles
        before = decimator_clocks.latency_cycles(self.decimator, self.channels)
        before += 0 if self.calibration is None else self.calibration.latency_cycles
        several = self.channels > 1  # which are let in when all is cleared
        still_cleared = 0 if several else self._cleared_cycles - decimator_clocks.reset_cycles(self.decimator)
        return max(before, still_cleared) + self._latency_cycles + self.hold

    @property
    def clock_estimate(self) -> float | None:
        """Estimate of the highest clock for one channel, on an ECP5, in Hz; None where no loop closes in one clock."""
        return None

    @property
    def reset_cycles(self) -> int:
        """Clocks after a reset until a sample on offer is accepted; an upper limit in serial."""
        if self.decimator is None:
            return self._cleared_cycles + self._taken_cycles
        filled = decimator_clocks.reset_cycles(self.decimator, self.channels)
        before = self.calibration
        if self.channels > 1:
            cleared = max(self._cleared_cycles, 0 if before is None else before._cleared_cycles)
            return max(cleared, filled) + (0 if before is None else before._taken_cycles)
        if before is None:
            return filled
        if not self.decimator.steady:
            return before._cleared_cycles + before._taken_cycles
        # The calibration gives the first sample that the decimator fills with.
        return before._cleared_cycles + before.latency_cycles + filled + decimator_clocks.FIRST_SAMPLE

    @property
    def cycles_per_sample(self) -> int:
        """Clocks between samples at the highest rate, an upper limit in serial.

        Rounded up behind a decimator, and with several samples a clock.
        """
        return -(-self.cycles_per_result // (1 if self.decimator is None else self.decimator.factor))

    @property
    def clocks_per_sample(self) -> float:
        """Clocks between samples at the highest rate, on average; an upper limit in serial.

        A whole number but behind a decimator, and with several samples a clock.
        """
        share = self.samples_per_clock if self.decimator is None else self.decimator.factor
        clocks = self.cycles_per_result
        return clocks / share if clocks % share else clocks // share

    @property
    def cycles_per_result(self) -> int:
        """Clocks between results at the highest rate; an upper limit in serial."""
        behind = self._cycles_per_sample
        if self.decimator is None:
            return behind
        each = 1 if self.calibration is None else self.calibration.cycles_per_result
        if self.channels > 1:
            return max(decimator_clocks.cycles_per_result_of_many(self.decimator, each=each), behind)
        return max(decimator_clocks.cycles_per_result(self.decimator, self._taken_cycles, each=each), behind)

    # Hardware.

    @abstractmethod
    def _core(self, *, before: bool = False) -> Component:
        """Make what works on the datapath's own stages, `before` a decimator or behind it."""

    def component(self) -> Component:
        """Make the hardware; the top module has the name of the datapath."""
        core = self._core()
        if self.decimator is None:
            return core
        from sosmith.hdl.decimation.decimator import DecimatedCore  # only what makes hardware loads Amaranth

        before = None if self.calibration is None else self.calibration._core(before=True)
        return DecimatedCore(self.datapath, core, before, hold=self.hold, opens=self._cleared_cycles)

    @property
    def _flags_given(self) -> int:
        """Flags of a sample that a decimator hands on to what stands behind it."""
        from sosmith.hdl.status import OF_INPUT, RAIL_ALONE

        return 0 if self.decimator is None else RAIL_ALONE if self.calibration is None else OF_INPUT

    # Words.

    def title(self, realization: str | None) -> str:
        """Return its name, with that of the `realization` if the hardware is built like it."""
        return f"{self.name} {realization or ''}".rstrip()

    def reason(self, why: str, available: int) -> str:
        """Say in a sentence that it was chosen and `why`, with `available` clocks for each result."""
        per = "a sample" if self.decimator is None else f"for {self.decimator.factor} samples"
        return f"{self.name}: {why}; takes {self.cycles_per_result:,} of {available:,} clocks {per}"
