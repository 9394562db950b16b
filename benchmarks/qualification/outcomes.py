"""A plugin of pytest that writes what became of each test, a line of JSON for each, to the file of OUTCOMES."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

FILE = "SOSMITH_OUTCOMES"
"""The environment variable that names the file."""


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Take a report: of the call, or of a set-up that skipped or failed."""
    if "PYTEST_XDIST_WORKER" in os.environ or (report.when != "call" and report.outcome == "passed"):
        return
    reason = ""
    if report.outcome == "skipped":
        reason = str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
    line = {"test": report.nodeid, "outcome": report.outcome, "reason": reason.removeprefix("Skipped: ")}
    with Path(os.environ[FILE]).open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
