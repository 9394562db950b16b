"""The table of the scenarios that fit a core."""

from __future__ import annotations

from collections.abc import Mapping

from sosmith.commands.tables.console import TableConsole, new_table


def print_scenarios(name: str, descriptions: Mapping[str, str]) -> None:
    """Print what each scenario for the specification `name` is."""
    table = new_table(f"Scenarios for {name}", ["name", "what it is"])
    for scenario, description in descriptions.items():
        table.add_row(scenario, description)
    TableConsole().print(table)
