"""What releases and CI are made of: actions by digest, rights that are stated, packages that are whole."""

from __future__ import annotations

import importlib.util
import json
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from tests.suite.extras import needs

import sosmith

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github").rglob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_actions_are_taken_by_digest(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"^\s*(?:- )?uses: (.+)$", text, re.MULTILINE)
    assert [one for one in used if not re.fullmatch(r"[\w.-]+/[\w.-]+@[0-9a-f]{40} # v[0-9.]+", one)] == []
    assert used or "composite" in text


@pytest.mark.parametrize("name", ["ci", "release", "site"])
def test_workflows_have_no_rights_but_those_that_they_state(name: str) -> None:
    text = (ROOT / ".github" / "workflows" / f"{name}.yml").read_text(encoding="utf-8")
    assert "\npermissions:\n  contents: read\n" in text
    assert "write-all" not in text
    assert "secrets." not in text


@pytest.mark.parametrize("target", ["sdist", "wheel"])
def test_packages_hold_all_of_the_source(target: str) -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = settings["tool"]["hatch"]["build"]["targets"][target]["only-include"]
    own = [path for path in (ROOT / "src" / "sosmith").iterdir() if not path.is_symlink() and path.name[0] != "_"]
    rooms = [path.name for path in (ROOT / "src" / "sosmith").iterdir() if path.is_symlink() and path.is_dir()]
    assert {*(f"src/sosmith/{path.name}" for path in own), *rooms} <= {*named}


def test_the_citation_names_this_version() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {sosmith.__version__}\n" in text


@needs("cyclonedx")
def test_the_bill_of_materials_names_each_package_with_its_hashes() -> None:
    bill = _bill()
    text = bill.bill()
    assert bill.bill() == text
    made: dict[str, Any] = json.loads(text)
    assert (made["bomFormat"], made["metadata"]["component"]["version"]) == ("CycloneDX", sosmith.__version__)
    pinned = {
        line.split(" ")[0].replace("==", "@")
        for level in ("base", "boards")
        for line in (ROOT / "requirements" / f"{level}.txt").read_text(encoding="utf-8").splitlines()
        if "==" in line
    }
    assert {f"{one['name']}@{one['version']}" for one in made["components"]} == pinned
    assert all(one["hashes"] for one in made["components"])


def _bill() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bill", ROOT / "requirements" / "bill.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
