"""Compares a module with the text that it must have, as the reader of SystemVerilog takes both."""

from __future__ import annotations

from sosmith.verify.graph import RejectedError, require
from sosmith.verify.reader.source import read_source
from sosmith.verify.reader.syntax import Module


def check_written(module: Module, text: str, name: str, what: str) -> None:
    """Check that a module is the one of a text.

    Raises
    ------
    RejectedError
        If it is another one.
    """
    wanted = read_source(text, name).modules[name]
    for part in ("ports", "widths", "registers", "depths", "contents", "instances"):
        own, read = getattr(wanted, part), getattr(module, part)
        require(own == read, f"the {part} of {name} must be {own}, not {read}")
    for own, read in zip(wanted.assigns, module.assigns, strict=False):
        require(own == read, f"{name} must assign {own[1]} to {own[0]}, not {read[1]} to {read[0]}")
    for own, read in zip(wanted.clocked, module.clocked, strict=False):
        require(own == read, f"{name} must have the statements {own[1]}, not {read[1]}")
    if module != wanted:
        raise RejectedError(f"{name} must have no more and no less than {what}")
