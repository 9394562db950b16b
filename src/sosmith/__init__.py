"""From a filter specification and calibration data to fixed-point FPGA hardware.

The public interface is the names in `__all__`; docs/python.md documents them. Everything is imported on first use, so
that importing the package itself is fast. The rooms behind it, each importing only from those to its right:
``cli -> studio -> interface -> host -> instrument, sim -> gen -> hdl, verify -> model``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sosmith.gen.version import __version__

if TYPE_CHECKING:
    from sosmith.gen.facts.table import Fact, Table
    from sosmith.host.board import Board, Results
    from sosmith.host.loading import Loaded
    from sosmith.interface.build import Build
    from sosmith.interface.calibration import Calibration
    from sosmith.interface.certificate import Certificate, Proof
    from sosmith.interface.chain.certificate import ChainCertificate, ChainProof
    from sosmith.interface.chain.design import Chain, design_chain
    from sosmith.interface.chain.filter import ChainFilter
    from sosmith.interface.chain.reload import ChainReload
    from sosmith.interface.chain.report import ChainReport
    from sosmith.interface.chain.specification import ChainSpecification
    from sosmith.interface.coefficients import Coefficients
    from sosmith.interface.comparison import Comparison, compare
    from sosmith.interface.design import Coefficient, Design, Section, design
    from sosmith.interface.drawing import Drawing
    from sosmith.interface.exploration import Exploration, explore
    from sosmith.interface.filter import Filter
    from sosmith.interface.quantity import Quantity
    from sosmith.interface.reload import Reload
    from sosmith.interface.report import Report
    from sosmith.interface.specification import Specification
    from sosmith.interface.trace import Trace
    from sosmith.model.errors import (
        LinkError,
        LinkLostError,
        RefusedError,
        ShortfallError,
        SosmithError,
        SpecificationError,
        ToolError,
    )
    from sosmith.model.link.identity import Identity

__all__ = [
    "Board",
    "Build",
    "Calibration",
    "Certificate",
    "Chain",
    "ChainCertificate",
    "ChainFilter",
    "ChainProof",
    "ChainReload",
    "ChainReport",
    "ChainSpecification",
    "Coefficient",
    "Coefficients",
    "Comparison",
    "Design",
    "Drawing",
    "Exploration",
    "Fact",
    "Filter",
    "Identity",
    "LinkError",
    "LinkLostError",
    "Loaded",
    "Proof",
    "Quantity",
    "RefusedError",
    "Reload",
    "Report",
    "Results",
    "Section",
    "ShortfallError",
    "SosmithError",
    "Specification",
    "SpecificationError",
    "Table",
    "ToolError",
    "Trace",
    "__version__",
    "compare",
    "design",
    "design_chain",
    "explore",
]

_MODULES = {
    "host.board": ("Board", "Results"),
    "host.loading": ("Loaded",),
    "interface.build": ("Build",),
    "interface.calibration": ("Calibration",),
    "interface.certificate": ("Certificate", "Proof"),
    "interface.chain.certificate": ("ChainCertificate", "ChainProof"),
    "interface.chain.design": ("Chain", "design_chain"),
    "interface.chain.filter": ("ChainFilter",),
    "interface.chain.reload": ("ChainReload",),
    "interface.chain.report": ("ChainReport",),
    "interface.chain.specification": ("ChainSpecification",),
    "interface.coefficients": ("Coefficients",),
    "interface.comparison": ("Comparison", "compare"),
    "interface.design": ("Coefficient", "Design", "Section", "design"),
    "interface.drawing": ("Drawing",),
    "interface.exploration": ("Exploration", "explore"),
    "interface.filter": ("Filter",),
    "gen.facts.table": ("Fact", "Table"),
    "interface.quantity": ("Quantity",),
    "interface.reload": ("Reload",),
    "interface.report": ("Report",),
    "interface.specification": ("Specification",),
    "interface.trace": ("Trace",),
    "model.link.identity": ("Identity",),
    "model.errors": (
        "LinkError",
        "LinkLostError",
        "RefusedError",
        "ShortfallError",
        "SosmithError",
        "SpecificationError",
        "ToolError",
    ),
}
"""The module of each public name; the imports above tell type checkers the same."""


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    for module, names in _MODULES.items():
        if name in names:
            value = getattr(import_module(f"sosmith.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *__all__})
