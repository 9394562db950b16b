"""What tests need that not every machine has: without it they are skipped, with the reason."""

import importlib
import importlib.util
from typing import Any

import pytest

HOW = "pip install 'sosmith[test]'"


def needed(module: str) -> Any:
    """Import a module; without its package, skip the file of tests that asks for it."""
    return pytest.importorskip(module, reason=_missing(module))


def needs(*modules: str) -> pytest.MarkDecorator:
    """Skip tests without these packages, which programs that they start import."""
    missing = [module for module in modules if not _is_there(module)]
    return pytest.mark.skipif(bool(missing), reason=", ".join(map(_missing, missing)) or "nothing is missing")


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def _missing(module: str) -> str:
    return f"{module.partition('.')[0]} is not installed: {HOW}"
