"""Results of a co-simulation of a chain."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sosmith.gen.chain.report.report import report_table
from sosmith.gen.chain.report.run import ChainRun
from sosmith.gen.facts.table import Table, View


@dataclass(frozen=True, eq=False)
class ChainReport(View):
    """The results of `Chain.simulate`.

    Attributes
    ----------
    summary : dict
        The content of ``report.json``.
    folder : Path
        Folder of the files, including ``report.html``.
    run : ChainRun
        Codes in and out, and the exact results.
    """

    summary: dict[str, Any] = field(repr=False)
    folder: Path
    run: ChainRun = field(repr=False)

    @property
    def passed(self) -> bool:
        """Whether every result equals that of the integer models, and no error exceeds the bound."""
        return bool(self.summary["passed"])

    @property
    def bit_exact(self) -> bool:
        """Whether every result equals that of the integer models."""
        return bool(self.summary["bit_exact"])

    @property
    def table(self) -> Table:
        """Verdict, arithmetic and speed."""
        return report_table(self.summary)

    def tables(self) -> list[Table]:
        """Return `table` alone."""
        return [self.table]
