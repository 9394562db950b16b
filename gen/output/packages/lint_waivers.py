"""The warnings of Verilator that generated cores draw, and why each is harmless."""

from __future__ import annotations

from collections.abc import Sequence

from sosmith.model.templates import render

WAIVERS = {
    "DECLFILENAME": "all modules of a core stand in one file, which has the name of the top module",
    "PROCASSINIT": "a register's declaration gives the value that an FPGA loads at configuration, as its reset does",
    "UNUSEDSIGNAL": "a format drops the bits beyond its proven range or below its rounding, on purpose",
    "WIDTHEXPAND": "operands of a sum differ in width, and the language extends the narrower one by its sign",
}
"""Warnings of Verilator's ``-Wall`` that generated cores cause, and why each is harmless."""

_OF_JOINTS = {
    "UNOPTFLAT": "upper bits of a word are copies of its sign: the word is made of itself, but no bit of it is",
}
"""The same of modules that join cores, or a core and its decimator, where Verilator takes a word as one signal."""


def verilator_waivers(modules: Sequence[str], *, joins: bool) -> str:
    """Return a configuration file for Verilator that waives them in the files of `modules`, the last the top.

    `joins` says whether one of them joins cores.
    """
    waivers = WAIVERS | _OF_JOINTS if joins else WAIVERS
    return render(__package__, "waivers.vlt.jinja", name=modules[-1], modules=modules, waivers=waivers)
