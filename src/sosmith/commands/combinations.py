"""The command `combinations`: what goes together in a specification."""

from __future__ import annotations

import click

from sosmith.model.errors import SpecificationError
from sosmith.terminal import JSON_OPTION, print_json, reader_may_leave


@click.command("combinations")
@click.option("--markdown", is_flag=True, help="Print GitHub-flavoured Markdown instead of a table.")
@JSON_OPTION
def combinations_command(*, markdown: bool, as_json: bool) -> None:
    """Show which architectures and options of a specification go together.

    Each pair is ok; of no use, as one takes away what the other is for; refused for a reason of principle; or not yet
    there. The reasons follow the table.

    \b
        sosmith combinations
        sosmith combinations --json
    """
    if markdown and as_json:
        raise SpecificationError("--markdown must come without --json, not with it")
    from sosmith.interface.specification import Specification

    pairs = Specification.combinations()
    with reader_may_leave():
        if as_json:
            print_json([each._asdict() for each in pairs])
            return
        from sosmith.commands.tables import combinations as tables
        from sosmith.commands.tables.console import TableConsole

        if markdown:
            click.echo(tables.markdown(pairs), nl=False)
        else:
            tables.print_combinations(TableConsole(), pairs)
