"""The registers of a stage that interpolates, one set for all of its cores: `sosmith.hdl.shared_registers`."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

from sosmith.gen.chain.design import ChainDesign, StageDesign
from sosmith.gen.reload.register_map import c_registers, systemrdl


@dataclass(frozen=True, kw_only=True)
class RegistersUnit:
    """The registers of several cores.

    Attributes
    ----------
    stage : str
        Names of the chain and of the stage, as files of the stage begin.
    banks : tuple of (int, int)
        Words of a bank of each core, and bits of a word.
    design : int
        Fingerprint of all cores together.
    protected : bool
        Whether they count faults.
    lock : bool
        Whether loading can be locked.
    """

    stage: str
    banks: tuple[tuple[int, int], ...]
    design: int
    protected: bool
    lock: bool

    @property
    def name(self) -> str:
        """Name of the module."""
        return f"{self.stage}_registers"

    @property
    def words(self) -> int:
        """Words of a load."""
        return sum(words for words, _ in self.banks)

    def files(self) -> dict[str, str]:
        """Return the files that describe the registers, by their names."""
        return {
            name: text(self.stage, words=self.words, design=self.design, protected=self.protected, lock=self.lock)
            for name, text in ((f"{self.stage}_registers.h", c_registers), (f"{self.stage}.rdl", systemrdl))
        }

    def nets(self, net: str) -> dict[str, str]:
        """Return the nets at its ports, without those of the AXI4-Lite port, in a top where the stage's is `net`."""
        nets = {"aclk": "aclk", "aresetn": "aresetn", "i_between": f"{net}_between", "o_bank": f"{net}_reload_bank"}
        nets |= {"o_acknowledge": f"{net}_reload_acknowledge"} if self.protected else {}
        for k in range(len(self.banks)):
            nets |= {f"o{k}_{each}": f"{net}_p{k}_reload_{each}" for each in ("write", "address", "data")}
            given = ("free", *(("corrected", "failed") if self.protected else ()))
            nets |= {f"i{k}_{each}": f"{net}_p{k}_reload_{each}" for each in given}
        return nets


def registers_unit(design: ChainDesign, stage: StageDesign) -> RegistersUnit | None:
    """Return the registers of the cores of a stage; None if there is one core, or nothing can be loaded."""
    hardware = stage.design.spec.hardware
    if len(stage.modules) == 1 or not hardware.reload:
        return None
    prints = [core.architecture.fingerprint or 0 for core in stage.cores]
    return RegistersUnit(
        stage=f"{design.name}_{stage.spec.name}",
        banks=tuple(core.architecture.bank_size for core in stage.cores),
        design=zlib.crc32(b"".join(each.to_bytes(4, "little") for each in prints)),
        protected=hardware.protect != "none",
        lock=stage.spec.locks(design.spec),
    )
