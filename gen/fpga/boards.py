"""FPGAs and boards as data for synthesis, gate-level simulation and placement."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean

RATE = 1_000_000
"""Rate of a board's serial line without another wish, in baud."""

_LUTS = {
    "SB_LUT4": 1,
    **dict.fromkeys(("LUT1", "LUT2", "LUT3", "LUT4", "ALU"), 1),
    **{"CCU2C": 2, "TRELLIS_DPR16X4": 4, "RAM16SDP4": 4},
    **dict.fromkeys(("CC_LUT1", "CC_LUT2", "CC_LUT3", "CC_LUT4", "CC_L2T4", "CC_MX2", "CC_ADDF"), 1),
    **{"CC_L2T5": 2, "CC_MX4": 2},
}
"""Number of LUT4 that a cell uses; on a Gowin FPGA smaller LUTs are cells of their own, and so is one with a carry. On
a GateMate a LUT4 is half of a programmable element, as nextpnr counts them: CPE_LT. Its multipliers are made of these
as well, and not counted."""


@dataclass(frozen=True, kw_only=True)
class Device:
    """An FPGA, in any package.

    Attributes
    ----------
    family : str
        ``"ice40"``, ``"ecp5"``, ``"gowin"``, ``"gatemate"`` or ``"xilinx"``: the name of the cell library.
    title : str
        Name for display.
    synthesis : str
        Yosys command that maps a design onto its cells.
    placer : str
        Option of nextpnr that selects it; "" if no open flow is run for it.
    logic_cells : int
        Number of LUT4, each with a flip-flop; of LUT6 in a Xilinx FPGA.
    multiplier : str or None
        Cell type of the multiplier block, SB_MAC16 or MULT18X18D; None if there is none.
    factor_bits : int
        Width of its factors, which may be signed; 0 if there is none.
    multipliers : int
        Number of multiplier blocks.
    block_ram : str
        Cell type of the block RAM: SB_RAM40_4K holds 4,096 bits, DP16KD 18,432, SDPB 16,384,
        CC_BRAM_20K 20,480.
    block_rams : int
        Number of block RAMs.
    pll_limit : int
        Highest clock in Hz that its PLL is asked for; 0 if none is used.
    """

    family: str
    title: str
    synthesis: str
    placer: str
    logic_cells: int
    multiplier: str | None
    factor_bits: int
    multipliers: int
    block_ram: str
    block_rams: int
    pll_limit: int = 0

    def luts(self, cells: dict[str, int]) -> int:
        """Count the LUT4 that a netlist takes, also as carry cells and distributed memory; `cells` as for `excess`."""
        return sum(weight * cells.get(kind, 0) for kind, weight in _LUTS.items())

    def excess(self, cells: dict[str, int]) -> list[str]:
        """List the cells of which a netlist needs more than the FPGA has; placement may fail even if there are none.

        Parameters
        ----------
        cells : dict of str to int
            Count by cell type.

        Returns
        -------
        list of str
            Items such as ``"13 SB_MAC16 of 8"``.
        """
        needed = [
            ("LUT4", self.luts(cells), self.logic_cells),
            (self.multiplier, cells.get(self.multiplier or "", 0), self.multipliers),
            (self.block_ram, cells.get(self.block_ram, 0), self.block_rams),
        ]
        return [f"{count:,} {kind} of {there:,}" for kind, count, there in needed if count > there]


@dataclass(frozen=True, kw_only=True)
class Board:
    """A commercially available board.

    Attributes
    ----------
    name : str
        As on the command line.
    title : str
        Name for display.
    device : Device
        Its FPGA.
    package, speed : str
        Names in nextpnr; iCE40 devices have no speed grade.
    clock : int
        Frequency of the oscillator at a clock pin, in Hz.
    platform : str or None
        Class that knows its pins, as ``module:name``; None for a board that no bitstream is made for.
    loader : str or None
        Its name in openFPGALoader.
    header : tuple of str
        Pins of its headers for the SPI of converters: SCK, MOSI, MISO, then the chip selects.
    audio : tuple of str
        Pins of its headers for audio converters, in the order of a Pmod I2S2: MCLK, LRCK, BCLK and data of a DAC, the
        same of an ADC, then data lines of further ones.
    """

    name: str
    title: str
    device: Device
    package: str
    speed: str
    clock: int
    platform: str | None = None
    loader: str | None = None
    header: tuple[str, ...] = ()
    audio: tuple[str, ...] = ()


# Numbers of cells are those that nextpnr 0.11.1 reports for an empty design.
_UP5K = Device(
    family="ice40",
    title="iCE40 UP5K",
    synthesis="synth_ice40 -device u -dsp",
    placer="--up5k",
    logic_cells=5280,
    multiplier="SB_MAC16",
    factor_bits=16,
    multipliers=8,
    block_ram="SB_RAM40_4K",
    block_rams=30,
    pll_limit=25_000_000,  # cores close timing at some 34 MHz
)
_HX8K = Device(
    family="ice40",
    title="iCE40 HX8K",
    synthesis="synth_ice40 -device hx",
    placer="--hx8k",
    logic_cells=7680,
    multiplier=None,
    factor_bits=0,
    multipliers=0,
    block_ram="SB_RAM40_4K",
    block_rams=32,
    pll_limit=50_000_000,
)
_HX1K = replace(_HX8K, title="iCE40 HX1K", placer="--hx1k", logic_cells=1280, block_rams=16)
_ECP5_25 = Device(
    family="ecp5",
    title="ECP5 LFE5U-25F",
    synthesis="synth_ecp5",
    placer="--25k",
    logic_cells=24288,
    multiplier="MULT18X18D",
    factor_bits=18,
    multipliers=28,
    block_ram="DP16KD",
    block_rams=56,
    pll_limit=50_000_000,
)
_ECP5_12 = replace(_ECP5_25, title="ECP5 LFE5U-12F", placer="--12k")  # the same die
_ECP5_45 = replace(_ECP5_25, title="ECP5 LFE5U-45F", placer="--45k", logic_cells=43848, multipliers=72, block_rams=108)
_ECP5_85 = replace(_ECP5_25, title="ECP5 LFE5U-85F", placer="--85k", logic_cells=83640, multipliers=156, block_rams=208)
_ECP5_85_5G = replace(_ECP5_85, title="ECP5 LFE5UM5G-85F", placer="--um5g-85k")

# Placers do not know how long a Gowin multiplier takes, so none is used.
_GW1NR_9C = Device(
    family="gowin",
    title="GW1NR-9C",
    synthesis="synth_gowin -nodsp",
    placer="GW1NR-LV9QN88PC6/I5",
    logic_cells=8640,
    multiplier=None,
    factor_bits=0,
    multipliers=0,
    block_ram="SDPB",
    block_rams=26,
    pll_limit=50_000_000,
)
_GW2AR_18C = replace(
    _GW1NR_9C,
    title="GW2AR-18C",
    synthesis="synth_gowin -nodsp -family gw2a",
    placer="GW2AR-LV18QN88C8/I7",
    logic_cells=20736,
    block_rams=46,
)

# A multiplier is an array of programmable elements, one for each 2 x 2 bits, and a signal passes all rows of it. Yosys
# makes one where both factors vary; products by constants take less room as adders, and are faster.
_CCGM1A1 = Device(
    family="gatemate",
    title="GateMate CCGM1A1",
    synthesis="synth_gatemate -luttree -nomx8",
    placer="CCGM1A1",
    logic_cells=40960,
    multiplier=None,
    factor_bits=0,
    multipliers=0,
    block_ram="CC_BRAM_20K",
    block_rams=64,
)


# Numbers of cells are those of Xilinx DS180, 7 Series FPGAs Overview: LUT6, DSP48E1, RAMB36E1.
_XC7A35T = Device(
    family="xilinx",
    title="Artix-7 XC7A35T",
    synthesis="synth_xilinx -family xc7",
    placer="",
    logic_cells=20800,
    multiplier="DSP48E1",
    factor_bits=18,
    multipliers=90,
    block_ram="RAMB36E1",
    block_rams=50,
)
_XC7S25 = replace(_XC7A35T, title="Spartan-7 XC7S25", logic_cells=14600, multipliers=80, block_rams=45)


def _pins(names: str) -> tuple[str, ...]:
    return tuple(names.split())


_ULX3S = Board(
    name="ulx3s_25f",
    title="ULX3S 25F",
    device=_ECP5_25,
    package="CABGA381",
    speed="6",
    clock=25_000_000,
    platform="amaranth_boards.ulx3s:ULX3S_25F_Platform",
    loader="ulx3s",
    # GP0 and GN0 to GP9 and GN9
    header=_pins("B11 C11 A10 A11 A9 B10 B9 C10 A7 A8 C8 B8 C6 C7 A6 B6 A4 A5 A2 B1"),
    # GP14 to GP17, GN14 to GN17; GP18, GN18, GP19, GN19
    audio=_pins("U18 N17 N16 L16 U17 P16 M17 L17 H18 H17 F17 G18"),
)


def _ulx3s(size: str, device: Device) -> Board:
    platform = f"amaranth_boards.ulx3s:ULX3S_{size.upper()}_Platform"
    return replace(_ULX3S, name=f"ulx3s_{size}", title=f"ULX3S {size.upper()}", device=device, platform=platform)


# FPGA, package, speed grade and clock are from amaranth-boards 0.0.21; those of the Colorlight i5, 7.0, from its pinout
# in wuxx/Colorlight-FPGA-Projects. On an UPduino 3, a solder jumper connects the oscillator to its pin.
_ALL = (
    Board(
        name="icebreaker",
        title="iCEBreaker",
        device=_UP5K,
        package="sg48",
        speed="",
        clock=12_000_000,
        platform="amaranth_boards.icebreaker:ICEBreakerPlatform",
        loader="ice40_generic",
        # PMOD1A as an SPI, chip selects 1 and 7 to 10; PMOD1B; PMOD2
        header=_pins("45 2 47 4 3 48 46 44 43 38 34 31 42 36 32 28 27 25 21 19 26 23 20 18"),
        # PMOD1B, then PMOD2
        audio=_pins("43 38 34 31 42 36 32 28 27 25 21 19"),
    ),
    Board(name="upduino", title="UPduino 3", device=_UP5K, package="sg48", speed="", clock=12_000_000),
    Board(
        name="ice40_hx8k_b_evn",
        title="iCE40-HX8K-B-EVN",
        device=_HX8K,
        package="ct256",
        speed="",
        clock=12_000_000,
        platform="amaranth_boards.ice40_hx8k_b_evn:ICE40HX8KBEVNPlatform",
        loader="ice40_generic",
        # J2, from its first pins on
        header=_pins("R15 P16 P15 N16 M15 M16 L16 K15 K16 K14 J14 G14 F14 J15 H14 H16 G15 G16 F15 F16 E14"),
        audio=_pins("J14 G14 F14 J15 H16 G15 G16 F15 F16 E14"),
    ),
    Board(
        name="icestick",
        title="iCEstick",
        device=_HX1K,
        package="tq144",
        speed="",
        clock=12_000_000,
        platform="amaranth_boards.icestick:ICEStickPlatform",
        loader="ice40_generic",
        # the Pmod J2 as an SPI, chip selects 1 and 7 to 10; J1; J3
        header=_pins("81 79 80 78 87 88 90 91 112 113 114 115 116 117 118 119 62 61 60 56 48 47 45 44"),
        # J1, then J3
        audio=_pins("112 113 114 115 116 117 118 119 62 61 60 56"),
    ),
    _ulx3s("12f", _ECP5_12),
    _ULX3S,
    _ulx3s("45f", _ECP5_45),
    _ulx3s("85f", _ECP5_85),
    replace(_ULX3S, name="colorlight_i5", title="Colorlight i5", platform=None, loader=None, header=(), audio=()),
    Board(
        name="orangecrab_25f",
        title="OrangeCrab 25F",
        device=_ECP5_25,
        package="CSFBGA285",
        speed="8",
        clock=48_000_000,
    ),
    Board(
        name="ecp5_evn",
        title="ECP5-5G-EVN",
        device=_ECP5_85_5G,
        package="CABGA381",
        speed="8",
        clock=12_000_000,
    ),
    Board(
        name="tang_nano_9k",
        title="Tang Nano 9K",
        device=_GW1NR_9C,
        package="",
        speed="",
        clock=27_000_000,
        platform="amaranth_boards.tang_nano_9k:TangNano9kPlatform",
        loader="tangnano9k",
        # J6 in litex-hub/litex-boards and in the repository of amaranth-boards, which has its bank at 3.3 V; 33 to 35
        # and 40 to 42 are an LCD's too
        header=_pins("25 26 27 28 29 30 33 34 40 35 41 42"),
        audio=_pins("33 34 40 35 41 42 30 29"),
    ),
    Board(
        name="tang_nano_20k",
        title="Tang Nano 20K",
        device=_GW2AR_18C,
        package="",
        speed="",
        clock=27_000_000,
        platform="sosmith.gen.fpga.tang_nano_20k:TangNano20kPlatform",
        loader="tangnano20k",
        # J6, then J5, in litex-hub/litex-boards, but for what other parts are at, by the nets' names in
        # hra1129/TangCartMSX: LEDs 15 to 20 and 79, HDMI 25, 26, 52, 53, audio 51 and 54 to 56, backlight 49, SPI of
        # the USB bridge 75, 76, 86, microSD 80, 85; and for 74, dead in zizineco/tang-nano-20k-pin73-problem. At 3.3
        # V: 27 to 31, 41, 42, 48, 77, an LCD's, in sipeed/TangNano-20K-example, 71 and 72 in nand2mario/nestang, 73
        # in zizineco's
        header=_pins("73 77 27 28 29 30 31 42 41 48 72 71"),
        audio=_pins("30 31 42 41 48 72 71 29"),
    ),
    Board(
        name="olimex_gatemate",
        title="GateMateA1-EVB",
        device=_CCGM1A1,
        package="",
        speed="",
        clock=10_000_000,
        platform="sosmith.gen.fpga.gatemate:OlimexGateMateA1Platform",
        loader="olimex_gatemateevb",
    ),
    Board(
        name="arty_a7",
        title="Arty A7-35T",
        device=_XC7A35T,
        package="csg324",
        speed="1L",
        clock=100_000_000,
        platform="amaranth_boards.arty_a7:ArtyA7_35Platform",
        # the Pmod JA as an SPI, chip selects 1 and 7 to 10; JB; JC
        header=_pins("D12 B11 A11 G13 D13 B18 A18 K16 E15 E16 D15 C15 J17 J18 K15 J15 U12 V12 V10 V11 U14 V14 T13 U13"),
        # JB, then JC
        audio=_pins("E15 E16 D15 C15 J17 J18 K15 J15 U12 V12 V10 V11"),
    ),
    Board(
        name="cmod_s7",
        title="CMOD S7",
        device=_XC7S25,
        package="csga225",
        speed="1",
        clock=12_000_000,
        platform="amaranth_boards.cmod_s7:CmodS7_Platform",
        # the Pmod as an SPI, chip selects 1 and 7 to 10; pins 1 to 9
        header=_pins("F3 H2 H4 J2 H3 H1 G1 F4 L1 M4 M3 N2 M2 P3 N3 P1 N1"),
        audio=_pins("L1 M4 M3 N2 M2 P3 N3 P1"),
    ),
)

BOARDS = {board.name: board for board in _ALL}
"""Boards by name."""

BUILDABLE = tuple(name for name, board in BOARDS.items() if board.platform is not None and board.device.placer)
"""Names of the boards that bitstreams are made for."""

PROJECTS = tuple(name for name, board in BOARDS.items() if board.device.family == "xilinx")
"""Names of the boards for which project files are written, and no flow is run."""

SYNTHESIZED = tuple(name for name in BOARDS if name not in PROJECTS)
"""Names of the boards whose cells are counted after synthesis."""

MODELLED = tuple(name for name, board in BOARDS.items() if board.device.family in {"ice40", "ecp5", "gatemate"})
"""Names of the boards whose netlists can be simulated: there are models of all cells."""


def find_board(name: str, among: Iterable[str] = BOARDS) -> Board:
    """Return the board `name`, which may be written with hyphens and capitals.

    Raises
    ------
    SpecificationError
        If it is not `among` these; lists them.
    """
    known = tuple(among)
    plain = name.lower().replace("-", "_")
    if plain not in known:
        raise SpecificationError(f"the board must be one of {', '.join(known)}, not {name}{did_you_mean(plain, known)}")
    return BOARDS[plain]
