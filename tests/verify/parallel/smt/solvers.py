"""Solvers of bit vectors, each of another maker: what they say of a text in SMT-LIB."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import pytest

SECONDS = 120
"""Time for one goal; those of small cores take seconds."""


def _z3(text: str) -> str:
    import z3  # noqa: PLC0415 - a package of tests, which may be missing

    solver = z3.Solver()
    solver.set("timeout", SECONDS * 1000)
    solver.from_string(text)
    return str(solver.check())


def _cvc5(text: str) -> str:
    import cvc5  # noqa: PLC0415

    solver = cvc5.Solver()
    solver.setOption("tlimit-per", str(SECONDS * 1000))
    parser = cvc5.InputParser(solver)
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, text, "goal")
    symbols = parser.getSymbolManager()
    said = ""
    while not (command := parser.nextCommand()).isNull():
        said = command.invoke(solver, symbols) or said
    return str(said).strip()


_KNOWN: dict[str, tuple[str, Callable[[str], str]]] = {"z3": ("z3-solver", _z3), "cvc5": ("cvc5", _cvc5)}
NAMES = tuple(_KNOWN)


def answer(name: str, text: str) -> str:
    """Return what a solver says of a text: sat, unsat or unknown; skip the test where it is not installed."""
    package, solve = _KNOWN[name]
    if find_spec(name) is None:
        pytest.skip(f"the solver {name} is not installed: pip install {package}")
    return solve(text)
