"""Tables in the terminal: where their cells are broken."""

import io

from rich.console import Console

from sosmith.commands.tables.console import new_table


def shown(width: int, *cells: str) -> list[str]:
    """Return the lines of a table with one row."""
    table = new_table("T", [""] * len(cells))
    table.add_row(*cells)
    printed = io.StringIO()
    Console(file=printed, width=width).print(table)
    return [line.strip() for line in printed.getvalue().splitlines()[1:] if line.strip()]


def test_a_path_is_broken_after_a_slash_and_nowhere_else() -> None:
    path = "examples/measurements/march.csv:44"
    assert shown(40, path) == [path]
    assert shown(28, path) == ["examples/measurements/", "march.csv:44"]
    assert shown(18, path) == ["examples/", "measurements/", "march.csv:44"]


def test_words_beside_a_path_and_styles_are_kept() -> None:
    assert shown(17, "see [bold]a/long/way[/] to go") == ["see a/long/", "way to go"]
    assert shown(30, "[bold]passed[/]", "1 / 2") == ["passed   1 / 2"]


def test_only_a_name_longer_than_its_column_is_broken_within() -> None:
    assert shown(12, "a/abcdefghijkl") == ["a/", "abcdefgh", "ijkl"]
