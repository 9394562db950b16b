"""The paper's equations and tables, recomputed and compared with the printed figures."""

from __future__ import annotations

from typing import Any

from sosmith.gen.facts.table import Table, View
from sosmith.instrument.paper.comparison import LABELS
from sosmith.instrument.paper.document import paper_files, paper_json, summary_rows
from sosmith.instrument.paper.figures import read_paper_figures


class Paper(View):
    """The printed figures beside ours."""

    def __init__(self) -> None:
        self._printed = read_paper_figures()

    def tables(self) -> list[Table]:
        """Return how many figures of each part are reproduced, near, different or not comparable."""
        rows = [row[:-1] for row in summary_rows(self._printed)]
        return [Table("The paper's figures compared with ours", rows, ("", *LABELS))]

    def files(self) -> dict[str, str]:
        """Return the complete comparison as a Markdown file ``paper.md``, and its pictures in ``images/``."""
        return paper_files(self._printed)

    def figures(self) -> list[dict[str, Any]]:
        """Return all figures in JSON types."""
        return paper_json(self._printed)
