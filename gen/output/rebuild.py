"""Generates the files of a certificate again, from the specification and the options that it states."""

from __future__ import annotations

from collections.abc import Callable

from sosmith.gen.core import design_core
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.output.generate import generated
from sosmith.gen.specification.specification import Specification
from sosmith.model.errors import SpecificationError
from sosmith.verify.certificate_file import AboutEntry

_OPTIONS = ("core", "realization", "widths_of", "board")


def rebuilt(
    about: AboutEntry, spec: Specification, progress: Callable[[str], None] = lambda step: None
) -> dict[str, str]:
    """Return the texts of all files but the certificate, by name, as `sosmith generate` makes them.

    Parameters
    ----------
    about : AboutEntry
        What the certificate is about: the options.
    spec : Specification
        The specification.
    progress : callable
        Called with the name of each step.

    Raises
    ------
    SpecificationError
        If an option does not exist, or the specification has no such core.
    ShortfallError
        If no formats meet the specification.
    ToolError
        If Yosys fails.
    """
    unknown = sorted(set(about.options) - set(_OPTIONS))
    if unknown:
        raise SpecificationError(f"the options in the certificate must be {', '.join(_OPTIONS)}, not {unknown[0]}")
    board = about.options.get("board")
    design = design_core(
        spec,
        core=about.options.get("core"),
        realization=about.options.get("realization"),
        widths_of=about.options.get("widths_of"),
        board=None if board is None else find_board(board),
        progress=progress,
    )
    texts = generated(design, progress)
    return {name: text for name, text in texts.items() if not name.endswith(".certificate.json")}
