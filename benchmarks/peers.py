"""Other projects' filters, measured with the same tools, for comparison.

Fifth-order Butterworth low-pass at 1 kHz for 48 kHz and 16 bits in and out, unless stated otherwise. Yosys 0.70 and
nextpnr-ecp5 for an ECP5-85F, out of context, one seed. Widths, throughput and what can be changed at run time differ.
"""

from __future__ import annotations

from typing import NamedTuple


class Peer(NamedTuple):
    """One design of another project.

    Attributes
    ----------
    project : str
        Name, with the month of the last commit measured.
    what : str
        The design.
    luts, carries, flip_flops, multipliers : int
        LUT4, CCU2C, flip-flops, MULT18X18D.
    fmax : float
        Highest clock in MHz.
    error : str
        Largest measured error against double precision, on steps and a mixed signal, in output LSB.
    """

    project: str
    what: str
    luts: int
    carries: int
    flip_flops: int
    multipliers: int
    fmax: float
    error: str


UNKNOWN = "not measured"
PEERS = (
    Peer("litedsp, 2026-07", "28-bit data, 24 fraction bits, found by hand", 714, 535, 599, 30, 31.4, "0.58"),
    Peer("litedsp, 2026-07", "16-bit data", 418, 169, 340, 10, 50.2, "at least 37"),
    Peer("litedsp, 2026-07", "16-bit data, folded by three", 450, 169, 539, 10, 97.1, UNKNOWN),
    Peer("amlib, 2024-09", "34 bits, found by hand", 1681, 464, 374, 36, 41.2, "1.08"),
    Peer("linien, 2024-08", "25 bits, pipelined", 1252, 495, 884, 44, 54.9, UNKNOWN),
    Peer("filter-blocks, 2018-08", "24 bits", 965, 57, 194, 18, 52.4, UNKNOWN),
    Peer("Bedrock, 2026-06", "three sections, 28-bit data, reloadable", 588, 207, 939, 12, 84.4, UNKNOWN),
)


class Published(NamedTuple):
    """A core of another project as it publishes its figures; `source` is the file in its repository."""

    project: str
    what: str
    fpga: str
    luts: int
    flip_flops: int
    multipliers: int
    fmax: str
    samples: str
    source: str


PUBLISHED = (
    Published("litedsp", "three equal sections, I and Q", "ECP5", 1722, 834, 24, "57.2", "57.2 M", "doc/resources.md"),
    Published("litedsp", "the same, folded by three", "ECP5", 1646, 1293, 24, "134.4", "44.8 M", "doc/resources.md"),
    Published(
        "hdlguy/iir_filter",
        "three sections with a multiplier each",
        "Artix-7",
        250,
        406,
        3,
        "163, from a slack of 3.853 ns at 10 ns",
        "about 23 M, at 7 clocks",
        "verilog/ooc/results",
    ),
)
