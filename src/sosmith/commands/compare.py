"""The command `compare`: accuracy reports side by side."""

from __future__ import annotations

from pathlib import Path

import click

from sosmith.interface.files import write_file
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.output_paths import output_option
from sosmith.terminal import JSON_OPTION, note, print_json, reader_may_leave


@click.command("compare")
@click.argument("reports", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="REPORT REPORT...")
@click.option(
    "--baseline",
    type=click.Path(path_type=Path),
    metavar="REPORT",
    help="Exit with 1 if a REPORT falls short or is worse than this one.",
)
@click.option(
    "--tolerance",
    metavar="FIGURE=AMOUNT,...",
    help="Judge these figures only, each of which may be worse by a share (5%) or an amount (0): error, rms, sqnr, "
    "accuracy, true_error, bound, cycles, latency, lut, multipliers, registers, instructions, words.  [default: all, "
    "by nothing]",
)
@click.option("--markdown", is_flag=True, help="Print GitHub-flavoured Markdown instead of tables.")
@JSON_OPTION
@output_option("HTML file to write the comparison to as well.")
def compare_command(
    reports: tuple[Path, ...],
    baseline: Path | None,
    tolerance: str | None,
    markdown: bool,
    as_json: bool,
    output: Path | None,
) -> None:
    """Compare accuracy reports side by side.

    Each REPORT is a report.json file or the folder that contains it. Shows what differs first; the best of a figure is
    marked only where the reports are of the same exact calculation and the same input codes.

    With --baseline, a figure that cannot be compared counts as worse. examples/workflows/accuracy.yml does so for every
    pull request.

    \b
        sosmith compare build/clearance build/ramp -o comparison.html
        sosmith compare build/new --baseline build/old --tolerance error=5%,cycles=0,lut=2%
    """
    if markdown and as_json:
        raise SpecificationError("--markdown must come without --json, not with it")
    from sosmith.interface.comparison import compare

    comparison = compare(reports, baseline=baseline, tolerance=tolerance)
    if output is not None:
        write_file(output, comparison.page())
        note(f"wrote {output}")
    with reader_may_leave():
        if as_json:
            print_json(comparison.as_dict())
        elif markdown:
            click.echo(comparison.markdown())
        else:
            from sosmith.commands.tables.comparison import print_comparison

            print_comparison(comparison)
    if not comparison.passed:
        worse = ", ".join(one.name for one in comparison.judgements if not one.passed)
        raise ShortfallError(f"no report must be worse than the baseline, or impossible to judge, not {worse}")
