"""Other coefficients for a stage of a running chain: proven, and the writes that load them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.reload import ChainSwap, reload_chain, writes_json
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.facts.table import Table, View
from sosmith.interface.quantity import Quantity
from sosmith.model.errors import falling_short

if TYPE_CHECKING:
    from sosmith.interface.certificate import Progress


@dataclass(frozen=True, eq=False)
class ChainReload(View):
    """A set of coefficients that a stage of a running chain may load, from `Chain.reload`.

    Attributes
    ----------
    stage : str
        Name of the stage; the set is loaded at its registers, ``s_axil_`` and this name.
    bound : Quantity
        Proven end-to-end bound with the set: from a reset on, or once the swap has faded.
    allowed : Quantity
        What the specification allows.
    writes : dict
        What a host needs to load the set, as for `Design.reload`, and `chain`: name, stage and `error_bound`.
    """

    stage: str
    bound: Quantity
    allowed: Quantity
    writes: dict[str, Any] = field(repr=False)
    _swap: ChainSwap = field(repr=False)

    @classmethod
    def proven(
        cls, design: ChainDesign, wanted: ChainSpec, *, reset: bool, version: int, progress: Progress
    ) -> ChainReload:
        """Prove a set; parameters and errors are those of `Chain.reload`."""
        progress("set", 0, 0)
        with falling_short(wanted.base.path):
            swap = reload_chain(design, wanted, reset=reset)
        unit, stage = wanted.base.output.unit, swap.stage.spec.name
        chain = {"name": design.name, "stage": stage, "error_bound": float(swap.bound)}
        return cls(
            stage,
            Quantity(float(swap.bound), unit),
            Quantity(float(wanted.base.max_error), unit),
            writes_json(design, swap, version) | {"chain": chain},
            swap,
        )

    def tables(self) -> list[Table]:
        """Return the bound of the chain with the set, and what the swap takes."""
        stage, samples = self._swap.stage, self.writes["transient_samples"]
        seconds = samples / float(stage.spec.rate)
        fades = f"{samples:,} samples of the stage, {seconds:.3g} s; what it has put into later stages fades there"
        rows = [
            ("error bound", f"{self.bound} of {self.allowed} allowed, end to end"),
            ("registers", f"s_axil_{self.stage}"),
            ("transient", fades if samples else "none in the stage"),
            ("load", f"version {self.writes['version']}, {self.writes['words']:,} words"),
            ("for the design", f"0x{self.writes['design']:08X}"),
        ]
        return [Table(f"{self.writes['name']}: the set may be loaded", rows)]
