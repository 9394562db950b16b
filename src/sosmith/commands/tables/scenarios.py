"""The table of the scenarios that fit a core."""

from __future__ import annotations

from collections.abc import Mapping

from sosmith.commands.tables.console import TableConsole, new_table


def print_scenarios(name: str, descriptions: Mapping[str, str]) -> None:
    """Print the scenarios for the specification `name` with their descriptions."""
    table = new_table(f"Scenarios for {name}", ["name", "description"])
    for scenario, description in descriptions.items():
        table.add_row(scenario, description)
    TableConsole().print(table)
