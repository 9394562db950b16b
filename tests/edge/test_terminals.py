"""Terminals that are tiny, absent or none that anybody knows."""

from __future__ import annotations

import pytest
from rich.console import Console

from sosmith.commands.tables.console import TableConsole, new_table, print_all
from sosmith.terminal import NARROWEST, width
from tests.interface.small import filter_design


@pytest.mark.parametrize("columns", ["-1", "0", "1", "2", "3", "4", "5", "19", "20", "21", "wide", "100000"])
@pytest.mark.parametrize("term", ["", "dumb", "xterm", "none-such"])
def test_a_table_on_a_terminal_of_any_width(
    columns: str, term: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("TERM", term)
    table = new_table("a title that is longer than that", ["name", "value", "unit"])
    table.add_row("clearance", "1.234567", "mm")
    TableConsole().print(table)
    assert "mm" in capsys.readouterr().out
    assert TableConsole().width >= NARROWEST
    assert Console(stderr=True, width=width()).width >= NARROWEST


@pytest.mark.parametrize("columns", range(6))
def test_a_design_on_a_terminal_of_few_columns(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    print_all(filter_design().tables(details=True))
    assert "Butter" in "".join(capsys.readouterr().out.split())
