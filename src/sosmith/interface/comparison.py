"""Several reports side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.facts.table import Table, View
from sosmith.gen.report.comparison.baseline import Judgement, judge, read_tolerances
from sosmith.gen.report.comparison.choice import Choice, choose
from sosmith.gen.report.comparison.differences import Difference, differences
from sosmith.gen.report.comparison.markdown import comparison_markdown
from sosmith.gen.report.comparison.page import Group, comparison_page, groups
from sosmith.gen.report.comparison.report_file import load_report
from sosmith.gen.report.comparison.rows import Row, column_names
from sosmith.gen.report.comparison.rows import compare as compare_reports
from sosmith.gen.report.comparison.summary import comparison_json
from sosmith.interface.chain.report import ChainReport
from sosmith.interface.report import Report
from sosmith.model.errors import SpecificationError

__all__ = ["Comparison", "Difference", "Judgement", "compare"]

Source = Report | ChainReport | Mapping[str, Any] | str | PathLike[str]


@dataclass(frozen=True)
class Comparison(View):
    """Accuracy reports side by side, as returned by `compare`."""

    reports: tuple[Mapping[str, Any], ...] = field(repr=False)
    """The content of each ``report.json``; with a baseline, it is the first."""

    judgements: tuple[Judgement, ...] = field(default=(), repr=False)
    """Each other report beside the baseline: `name`, `passed`, `reasons`, `judged`; empty without a baseline."""

    @property
    def names(self) -> list[str]:
        """Name of each report, made unique if several are the same; a baseline is called so."""
        return column_names(self.reports, baseline=bool(self.judgements))

    @property
    def passed(self) -> bool:
        """Whether no report is worse than the baseline; true without one."""
        return all(one.passed for one in self.judgements)

    @property
    def differences(self) -> list[Difference]:
        """What is not the same in all reports: `group`, `title`, and `cells` as text."""
        return differences(self.reports)

    @property
    def choice(self) -> Choice:
        """The design to take: its index `taken` (None if there is none), and the `reason`."""
        return choose(self.reports, self.names)

    @property
    def rows(self) -> list[Row]:
        """The compared properties: `key`, `title`, `values`, `cells` as text, and the indices of the `best` reports."""
        return compare_reports(self.reports)

    @property
    def groups(self) -> list[Group]:
        """The same rows by group: `title`, `rows`, and why there is no winner in `unfair` (may be empty)."""
        return groups(self.reports)

    def as_dict(self) -> dict[str, Any]:
        """Return names, differences, rows, choice and the verdicts beside the baseline, in JSON types."""
        return comparison_json(self.reports, self.judgements)

    def page(self) -> str:
        """Return the comparison as a self-contained HTML page."""
        return comparison_page(self.reports, self.judgements)

    def markdown(self) -> str:
        """Return the comparison as GitHub-flavoured Markdown."""
        return comparison_markdown(self.reports, self.judgements)

    def tables(self) -> list[Table]:
        """Return `rows` as a table."""
        rows = [(row.title, *row.cells) for row in self.rows if row.key != "name"]
        return [Table("Accuracy reports", rows, ("", *self.names))]

    def __repr__(self) -> str:
        return f"<sosmith.Comparison of {', '.join(self.names)}>"


def compare(reports: Sequence[Source], *, baseline: Source | None = None, tolerance: str | None = None) -> Comparison:
    """Compare accuracy reports side by side.

    Parameters
    ----------
    reports : sequence of Report, ChainReport, path or mapping
        At least two, or one beside a baseline: the result of `Design.simulate` or `Chain.simulate`, a
        ``report.json``, its folder, or its content.
    baseline : Report, ChainReport, path or mapping
        Report that none of the others may be worse than; see `Comparison.passed`.
    tolerance : str
        How much worse a figure may be, such as ``"error=5%,cycles=0,lut=2%"``: a share of the baseline's value, or an
        amount in the figure's unit. The figures are error, rms, sqnr, accuracy, true_error (against the
        trace's true value), bound, cycles, latency, lut, multipliers, registers, instructions and words. Only those
        named are judged; without a tolerance, all that the baseline knows, and none may be worse. A figure that cannot
        be compared fairly does not pass.

    Raises
    ------
    SpecificationError
        If there are too few reports, a file is not a report, or the tolerance cannot be read.

    Examples
    --------
    >>> import sosmith
    >>> sosmith.compare([])
    Traceback (most recent call last):
    ...
    sosmith.model.errors.SpecificationError: reports must hold at least two reports, not none
    """
    if tolerance is not None and baseline is None:
        raise SpecificationError("a tolerance must come with a baseline, not without one")
    tolerances = None if tolerance is None else read_tolerances(tolerance)
    if len(reports) < (2 if baseline is None else 1):
        least = "two reports" if baseline is None else "one report beside the baseline"
        raise SpecificationError(f"reports must hold at least {least}, not {len(reports) or 'none'}")
    read = tuple(map(_content, reports))
    if baseline is None:
        return Comparison(read)
    first = _content(baseline)
    return Comparison((first, *read), tuple(judge(first, read, tolerances)))


def _content(report: Source) -> Mapping[str, Any]:
    if isinstance(report, Report | ChainReport):
        return report.summary
    if isinstance(report, Mapping):
        return report
    path = Path(fspath(report))
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    return load_report(path) | ({"folder": folder.name} if folder.name.isprintable() else {})
