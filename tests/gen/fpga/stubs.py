"""Stand-ins for the tools that make bitstreams."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

REPORT = {
    "fmax": {"board.clk": {"achieved": 70.123, "constraint": 12.0}},
    "utilization": {"ICESTORM_LC": {"used": 7, "available": 1280}, "TBUF": {"used": 4, "available": 0}},
    "critical_paths": [
        {
            "from": "posedge board.clk",
            "to": "posedge board.clk",
            "path": [
                {"type": "clk-to-q", "delay": 1.5, "to": {"cell": "a"}},
                {"type": "setup", "delay": 0.25, "to": {"cell": "b"}},
            ],
        },
        {
            "from": "<async>",
            "to": "posedge board.clk",
            "path": [{"type": "routing", "delay": 9.0, "to": {"cell": "c"}}],
        },
    ],
}

NETLIST = {"modules": {"top": {"attributes": {"top": "1"}, "ports": {}, "cells": {}}}}


@dataclass(frozen=True)
class Stub:
    """Stands for a program: leaves what nextpnr and a packer leave, or fails with some words."""

    name: str
    calls: list[list[str]]
    report: dict[str, Any]
    fails: str | None = None
    version: str = "1.2"

    def run(self, arguments: list[str], folder: Path, log: Path) -> int:
        self.calls.append([self.name, *arguments])
        with log.open("a", encoding="utf-8") as output:
            output.write(f"$ {self.name} {' '.join(arguments)}\n{self.fails or 'well'}\n")
        for place, following in zip(arguments, [*arguments[1:], ""], strict=True):
            if place == "--report":
                (folder / following).write_text(json.dumps(self.report), encoding="utf-8")
            if place == "--sdf":
                (folder / following).write_text("", encoding="utf-8")
                (netlist,) = (file for file in arguments if file.endswith(".json") and file != "report.json")
                (folder / netlist).write_text(json.dumps(NETLIST), encoding="utf-8")
        for suffix in ("bin", "bit", "fs"):
            for file in folder.glob("*.json"):
                if file.name.startswith("build_"):
                    (folder / f"{file.stem.removeprefix('build_')}.{suffix}").write_bytes(b"bits")
        return 0 if self.fails is None else 1
