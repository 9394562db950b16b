"""What is released: wheel and sdist hold the examples, and an installed copy runs them away from the repository.

The wheel goes into an empty environment; the packages that it depends on are borrowed from the one the tests run in.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tarfile
import venv
from pathlib import Path

import pytest
from tests.machines.made_files import ROOT

pytestmark = pytest.mark.slow

EXAMPLES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "examples").rglob("*")
    if path.is_file() and "__pycache__" not in path.parts
)
RECIPES = sorted(path.stem for path in (ROOT / "examples" / "recipes").glob("*.toml"))


def called(*command: str | Path, cwd: Path) -> str:
    """Run a command without the settings that lead to this checkout; return what it prints on stdout."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    result = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def released(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with wheel and sdist."""
    pytest.importorskip("hatchling", reason="hatchling is missing: pip install 'sosmith[release]'")
    folder = tmp_path_factory.mktemp("released")
    called(sys.executable, "-m", "hatchling", "build", "-d", folder, cwd=ROOT)
    return folder


@pytest.fixture(scope="module")
def installed(released: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the programs of an environment with the wheel in it."""
    root = tmp_path_factory.mktemp("installed")
    venv.create(root, with_pip=True)
    (wheel,) = released.glob("*.whl")
    called(root / "bin" / "python", "-m", "pip", "install", "--no-index", "--no-deps", wheel, cwd=root)
    (site,) = root.glob("lib/python*/site-packages")
    (site / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return root / "bin"


def test_the_sdist_has_the_examples(released: Path) -> None:
    (sdist,) = released.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {*EXAMPLES, "pyproject.toml", "README.md", "LICENSE"} <= inside


def test_the_wheel_has_the_examples(installed: Path, tmp_path: Path) -> None:
    where = called(installed / "python", "-c", "import sosmith; print(sosmith.__file__)", cwd=tmp_path)
    assert Path(where).is_relative_to(installed.parent)
    called(installed / "sosmith", "init", "--example", "all", cwd=tmp_path)
    copied = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file())
    assert copied == EXAMPLES


def test_an_installed_copy_runs_the_demo(installed: Path, tmp_path: Path) -> None:
    called(installed / "sosmith", "demo", "-o", "demo", cwd=tmp_path)
    assert (tmp_path / "demo" / "report.html").exists()


@pytest.mark.parametrize("recipe", RECIPES)
def test_an_installed_copy_designs_each_recipe(recipe: str, installed: Path, tmp_path: Path) -> None:
    called(installed / "sosmith", "init", "--example", f"recipes/{recipe}", cwd=tmp_path)
    assert called(installed / "sosmith", "design", f"{recipe}.toml", cwd=tmp_path).startswith(f"{recipe}: ")
