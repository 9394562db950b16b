"""Other coefficients for a running core: proven, and the writes that load them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sosmith.gen.core import CoreDesign
from sosmith.gen.facts.table import Table, View
from sosmith.gen.reload.register_writes import reload_json
from sosmith.gen.reload.reload import Swap, check_swap, own_set, set_for
from sosmith.interface.specification import Specification
from sosmith.model.errors import SpecificationError, falling_short

if TYPE_CHECKING:
    from sosmith.interface.certificate import Progress


@dataclass(frozen=True, eq=False)
class Reload(View):
    """A set of coefficients that a running core may load, from `Design.reload`.

    Attributes
    ----------
    wanted : Specification
        What the set is for.
    writes : dict
        The content of the file that `Board.load` takes.
    """

    wanted: Specification
    writes: dict[str, Any] = field(repr=False)
    _core: CoreDesign = field(repr=False)
    _swap: Swap = field(repr=False)

    @classmethod
    def proven(
        cls,
        core: CoreDesign,
        wanted: Specification,
        active: Specification | None,
        *,
        reset: bool,
        version: int,
        progress: Progress,
    ) -> Reload:
        """Prove a set; parameters and errors are those of `Design.reload`."""
        progress("set", 0, 0)
        if core.architecture.bank_pins is not None:
            raise SpecificationError(
                f"{core.spec.path}: hardware.reload_registers must be true for a core to be loaded by itself, not "
                "false: its registers belong to the chain that it is a part of"
            )
        with falling_short(wanted.checked.path):
            new = set_for(core, wanted.checked)
        with falling_short((core.spec if active is None else active.checked).path):
            before = own_set(core) if active is None else set_for(core, active.checked)
        progress("swap", 0, 0)
        swap = check_swap(core, None if reset else before, new)
        return cls(wanted, reload_json(core, swap, version), core, swap)

    @property
    def table(self) -> Table:
        """The error bound of the new set, and the transient of the swap."""
        core, swap, tree = self._core, self._swap, self.writes
        output, quantized, allowed = core.datapath.output, swap.new_set.quantized, self.wanted.checked.max_error
        unit, rate = f" {output.unit}".rstrip(), float(core.spec.sample_rate)
        bound = quantized.bound * output.lsb
        rows: list[Sequence[str]] = []
        if quantized.filter is not None:
            rows.append(("filter", quantized.filter.describe))
        rows.append(("error bound", f"{float(bound):.3g}{unit} of {float(allowed):.3g}{unit} allowed"))
        rows.append(("headroom", f"{float(allowed - bound):.3g}{unit}, {float(100 * (1 - bound / allowed)):.1f} %"))
        samples = swap.samples * quantized.samples_of_input
        fades = f"{samples:,} samples, {samples / rate:.3g} s, until the bound holds again"
        rows.append(("transient", fades if samples else "none, the bound holds from the first sample"))
        if core.architecture.restarts:
            settling = core.quantized.settling_of_input
            flagged = f"from zero; it flags {settling:,} samples as settling, {settling / rate:.3g} s"
            rows.append(("the core restarts", flagged if settling else "in the steady state of its next sample"))
        if swap.use:
            rows.append(("states", f"use at most {100 * float(swap.use):.3g} % of their range"))
        elif quantized.filter is not None:
            rows.append(("states", "hold past inputs only"))
        crc = tree["writes"][-1][1]
        rows.append(("load", f"version {tree['version']}, {tree['words']:,} words, CRC 0x{crc:08X}"))
        rows.append(("for the design", f"0x{tree['design']:08X}"))
        return Table(f"{core.spec.name}: the set may be loaded", rows)

    def tables(self) -> list[Table]:
        """Return `table` alone."""
        return [self.table]
