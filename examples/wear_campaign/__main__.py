"""The wear campaign, from depot measurements to wear: `python -m examples.wear_campaign`.

Emulated measurements are stored and fitted; filters are designed from spectra; hardware is generated and simulated; its
accuracy is compared with the paper's; ways of fitting are compared. Takes about half an hour. Writes campaign.md,
campaign.json, pictures, specifications, hardware and reports; with --document also docs/campaign.md, its pictures and
outcome.json. With --only-methods, only the ways of fitting are compared anew, and the rest is that of outcome.json;
with --without-methods, it is the other way round.
With --only-rule, only the linear fits of the paper's rule are counted anew.
"""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from pathlib import Path
from typing import Any

from examples.wear_campaign.campaign import SCENARIOS, carry_out, methods_campaign
from examples.wear_campaign.document import document
from examples.wear_campaign.methods import by_the_rule_alone
from examples.wear_campaign.pictures import pictures

from sosmith.instrument.scenarios.file import load_scenario
from sosmith.model.text_files import write_contents
from sosmith.terminal import note, show_progress

HERE = Path(__file__).parent
DOCS = HERE.parents[1] / "docs"


def main() -> None:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m examples.wear_campaign", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("build/wear_campaign"), help="folder for all files")
    parser.add_argument("--seeds", type=int, help="number of seeds, at least 2, instead of those in campaign.toml")
    parser.add_argument("--simulator", choices=("verilator", "icarus"), help="instead of that in campaign.toml")
    parser.add_argument("--document", action="store_true", help="also write docs/campaign.md and its pictures")
    parts = parser.add_mutually_exclusive_group()
    parts.add_argument("--only-methods", action="store_true", help="compare only the ways of fitting anew")
    parts.add_argument("--only-rule", action="store_true", help="count only the paper's rule's linear fits anew")
    parts.add_argument("--without-methods", action="store_true", help="do everything else anew")
    arguments = parser.parse_args()
    settings = tomllib.loads((HERE / "campaign.toml").read_text(encoding="utf-8"))
    settings |= {name: value for name, value in vars(arguments).items() if name in settings and value is not None}
    if arguments.seeds is not None:
        settings["methods"]["rule_seeds"] = arguments.seeds
    if settings["seeds"] < 2:
        parser.error(f"--seeds must be at least 2, not {settings['seeds']}")
    earlier = json.loads((HERE / "outcome.json").read_text(encoding="utf-8"))
    with show_progress() as step:
        if arguments.only_rule:
            scenarios = {name: load_scenario(SCENARIOS / f"{name}.toml") for name in settings["bench"]["scenarios"]}
            rule = by_the_rule_alone(settings, scenarios, arguments.output / "rule", step)
            results, series = earlier | {"settings": settings, "rule": rule}, {}
        elif arguments.only_methods:
            filter_table = earlier["ride"]["filters"][-1]["table"]
            compared = methods_campaign(settings, filter_table, arguments.output / "methods", step)
            results, series = {"settings": settings, **compared}, {}
            results |= {name: earlier[name] for name in ("bench", "ride", "week", "reloads")}
        else:
            recorded = (
                {name: earlier[name] for name in ("methods", "rule", "wear")} if arguments.without_methods else None
            )
            results, series = carry_out(settings, arguments.output, step, methods=recorded)
        step("pictures and document")
        drawn = pictures(results, series)
        text = document(results)
        files = {"campaign.md": text.encode(), "campaign.json": _as_json(results).encode()}
        write_contents(arguments.output, files)
        write_contents(arguments.output / "images", drawn)
    if arguments.document:
        write_contents(DOCS, {"campaign.md": text.encode()})
        write_contents(DOCS / "images", drawn)
        write_contents(HERE, {"outcome.json": files["campaign.json"]})
    note(f"report: {(arguments.output / 'campaign.md').resolve()}")


def _as_json(results: dict[str, Any]) -> str:
    """Return the figures as JSON, with those of all seeds in one line."""
    text = json.dumps(results, indent=1) + "\n"
    return re.sub(r"\[[^][{}\"]*\]", lambda numbers: " ".join(numbers[0].split()), text)


if __name__ == "__main__":
    main()
