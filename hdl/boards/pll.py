"""PLLs of FPGAs that make another clock from that of the board.

::

    clock pin --> / input --> phase detector --> VCO --+--> / output --> clock of the design
                                 ^                     |
                                 +---- / feedback <----+

    ECP5:  VCO = clock * feedback / input,              design = VCO / output
    iCE40: VCO = clock * feedback,                      design = VCO / output, a power of two
    Gowin: VCO = clock * feedback * scale / input,      design = VCO / (scale * output), an even output

No latency: clocks only. Until `locked` is high the clock has another frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from amaranth.hdl import Const, Instance, Signal, Value

MHZ = Fraction(10**6)


@dataclass(frozen=True, kw_only=True)
class Pll:
    """A PLL and its dividers.

    Attributes
    ----------
    family : str
        ``"ecp5"``, ``"ice40"`` or ``"gowin"``.
    device : str
        Name of the FPGA.
    reference : int
        Clock of the board in Hz.
    divider, feedback, output : int
        Dividers of its input, its feedback and its output.
    scale : int
        Divider between the VCO and the feedback of a Gowin PLL; else 1.
    """

    family: str
    device: str
    reference: int
    divider: int
    feedback: int
    output: int
    scale: int = 1

    @property
    def clock(self) -> Fraction:
        """The clock that it makes, in Hz."""
        return Fraction(self.reference * self.feedback, self.divider * self.output)

    def instance(self, pin: Value, clock: Signal, locked: Signal) -> Instance:
        """Return the cell, with the clock pin, the clock that it makes, and whether that has its frequency."""
        cells = {"ecp5": self._ecp5, "ice40": self._ice40, "gowin": self._gowin}
        return cells[self.family](pin, clock, locked)

    def _ecp5(self, pin: Value, clock: Signal, locked: Signal) -> Instance:
        # The first output has the divider of the feedback, the second one that of the output.
        fed_back = Signal()
        return Instance(
            "EHXPLLL",
            a_ICP_CURRENT="12",
            a_LPF_RESISTOR="8",
            a_MFG_ENABLE_FILTEROPAMP="1",
            a_MFG_GMCREF_SEL="2",
            p_PLLRST_ENA="DISABLED",
            p_INTFB_WAKE="DISABLED",
            p_STDBY_ENABLE="DISABLED",
            p_DPHASE_SOURCE="DISABLED",
            p_CLKOP_FPHASE=0,
            p_CLKOP_CPHASE=self.feedback - 1,
            p_OUTDIVIDER_MUXA="DIVA",
            p_CLKOP_ENABLE="ENABLED",
            p_CLKOP_DIV=self.feedback,
            p_CLKOS_FPHASE=0,
            p_CLKOS_CPHASE=self.output - 1,
            p_OUTDIVIDER_MUXB="DIVB",
            p_CLKOS_ENABLE="ENABLED",
            p_CLKOS_DIV=self.output,
            p_CLKFB_DIV=1,
            p_CLKI_DIV=self.divider,
            p_FEEDBK_PATH="CLKOP",
            i_CLKI=pin,
            i_CLKFB=fed_back,
            i_RST=Const(0, 1),
            i_STDBY=Const(0, 1),
            i_PHASESEL0=Const(0, 1),
            i_PHASESEL1=Const(0, 1),
            i_PHASEDIR=Const(1, 1),
            i_PHASESTEP=Const(1, 1),
            i_PHASELOADREG=Const(1, 1),
            i_PLLWAKESYNC=Const(0, 1),
            i_ENCLKOP=Const(0, 1),
            i_ENCLKOS=Const(0, 1),
            o_CLKOP=fed_back,
            o_CLKOS=clock,
            o_LOCK=locked,
        )

    def _ice40(self, pin: Value, clock: Signal, locked: Signal) -> Instance:
        return Instance(
            "SB_PLL40_PAD",
            p_FEEDBACK_PATH="SIMPLE",
            p_DIVR=Const(self.divider - 1, 4),
            p_DIVF=Const(self.feedback - 1, 7),
            p_DIVQ=Const(self.output.bit_length() - 1, 3),
            p_FILTER_RANGE=Const(1, 3),
            i_PACKAGEPIN=pin,
            i_RESETB=Const(1, 1),
            i_BYPASS=Const(0, 1),
            o_PLLOUTGLOBAL=clock,
            o_LOCK=locked,
        )

    def _gowin(self, pin: Value, clock: Signal, locked: Signal) -> Instance:
        return Instance(
            "rPLL",
            p_FCLKIN=f"{self.reference / 10**6:g}",
            p_DEVICE=self.device,
            p_DYN_IDIV_SEL="false",
            p_IDIV_SEL=self.divider - 1,
            p_DYN_FBDIV_SEL="false",
            p_FBDIV_SEL=self.feedback - 1,
            p_DYN_ODIV_SEL="false",
            p_ODIV_SEL=self.scale,
            p_DYN_SDIV_SEL=self.output,
            p_PSDA_SEL="0000",
            p_DYN_DA_EN="false",
            p_DUTYDA_SEL="1000",
            p_CLKOUT_FT_DIR=Const(1, 1),
            p_CLKOUTP_FT_DIR=Const(1, 1),
            p_CLKOUT_DLY_STEP=0,
            p_CLKOUTP_DLY_STEP=0,
            p_CLKFB_SEL="internal",
            p_CLKOUT_BYPASS="false",
            p_CLKOUTP_BYPASS="false",
            p_CLKOUTD_BYPASS="false",
            p_CLKOUTD_SRC="CLKOUT",
            p_CLKOUTD3_SRC="CLKOUT",
            i_CLKIN=pin,
            i_CLKFB=Const(0, 1),
            i_RESET=Const(0, 1),
            i_RESET_P=Const(0, 1),
            i_FBDSEL=Const(0, 6),
            i_IDSEL=Const(0, 6),
            i_ODSEL=Const(0, 6),
            i_PSDA=Const(0, 4),
            i_DUTYDA=Const(0, 4),
            i_FDLY=Const(0, 4),
            o_CLKOUTD=clock,
            o_LOCK=locked,
        )


def pll_near(family: str, device: str, reference: int, wanted: Fraction) -> Pll:
    """Return the dividers whose clock is nearest to a wanted one.

    Limits are those of Lattice FPGA-DS-02012 (ECP5), FPGA-DS-02008 (iCE40 UltraPlus) and of Gowin's rPLL in UG286.

    Parameters
    ----------
    family, device, reference
        As for `Pll`.
    wanted : Fraction
        In Hz.
    """
    search = {"ecp5": _near_ecp5, "ice40": _near_ice40, "gowin": _near_gowin}
    candidates = [
        Pll(family=family, device=device, reference=reference, divider=i, feedback=f, output=o, scale=s)
        for i, f, o, s in search[family](reference, wanted)
    ]
    return min(candidates, key=lambda pll: (abs(pll.clock - wanted), pll.divider, pll.feedback))


def _near_ecp5(reference: int, wanted: Fraction) -> list[tuple[int, int, int, int]]:
    settings = []
    for divider in range(1, int(reference / (10 * MHZ)) + 1):
        for feedback in range(1, 81):
            vco = Fraction(reference * feedback, divider)
            output = round(vco / wanted)
            if 400 * MHZ <= vco <= 800 * MHZ and 1 <= output <= 128:
                settings.append((divider, feedback, output, 1))
    return settings


def _near_ice40(reference: int, wanted: Fraction) -> list[tuple[int, int, int, int]]:
    return [
        (1, feedback, 1 << power, 1)
        for feedback in range(1, 129)
        for power in range(1, 7)
        if 533 * MHZ <= reference * feedback <= 1066 * MHZ
    ]


def _near_gowin(reference: int, wanted: Fraction) -> list[tuple[int, int, int, int]]:
    settings = []
    for divider in range(1, int(reference / (3 * MHZ)) + 1):
        for feedback in range(1, 65):
            fast = Fraction(reference * feedback, divider)
            output = 2 * round(fast / wanted / 2)
            scales = [s for s in (2, 4, 8, 16) if 500 * MHZ <= fast * s <= 1200 * MHZ]
            if 2 <= output <= 128 and scales and fast <= 500 * MHZ:
                settings.append((divider, feedback, output, scales[0]))
    return settings
