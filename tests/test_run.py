"""The script `./run`: which versions of Python it takes, and what it says of the others."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SUPPORTED = ("3.11", "3.12", "3.13", "3.14")
COMMANDS = ("cat", "cksum", "dirname", "echo", "sort", "xargs")
"""All that the script calls before it makes `.venv`."""


def installed(tmp_path: Path, *versions: str) -> subprocess.CompletedProcess[str]:
    """Call `./run --help` in a new checkout where Python has these versions, the first one as `python3`.

    Neither apt-get nor sudo can be found, so nothing is installed; `.venv` cannot be made.
    """
    (tmp_path / "bin").mkdir()
    for name in COMMANDS:
        (tmp_path / "bin" / name).symlink_to(shutil.which(name) or name)
    (tmp_path / "bin" / "g++").symlink_to("/bin/true")
    for place, version in enumerate(versions):
        path = tmp_path / "bin" / (f"python{version}" if place else "python3")
        as_told = f"import sys; sys.version_info = ({version.replace('.', ', ')}, 0)"
        path.write_text(
            f"#!/bin/sh\ncase $1 in\n--version) echo Python {version}.0 ;;\n"
            f'-c) exec {sys.executable} -c "{as_told}; $2" ;;\n-m) exit 1 ;;\nesac\n'
        )
        path.chmod(0o755)
    for name in ("run", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    return subprocess.run(
        [tmp_path / "run", "--help"],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": str(tmp_path / "bin")},
    )


def taken(version: str, name: str) -> tuple[int, list[str]]:
    """Exit status and messages when the Python called `name` is taken, and cannot make `.venv`."""
    return 3, [f"run: making .venv with Python {version}.0", f"run: {name} could not make .venv"]


@pytest.mark.parametrize("version", SUPPORTED)
def test_python_of_a_supported_version_is_taken(version: str, tmp_path: Path) -> None:
    result = installed(tmp_path, version)
    assert (result.returncode, result.stderr.splitlines()) == taken(version, f"{tmp_path}/bin/python3")


@pytest.mark.parametrize("version", ["3.9", "3.10", "3.15", "4.0"])
def test_any_other_version_is_refused_with_the_reason_and_a_way_out(version: str, tmp_path: Path) -> None:
    result = installed(tmp_path, version)
    assert result.returncode == 3
    assert result.stderr == (
        f"run: Python must be 3.11 to 3.14 (3.15 waits for cocotb), not python3 (Python {version}.0);"
        " 'apt-get install python3.14' or, where there is none, 'pipx run uv python install 3.14' gets one,"
        " and PYTHON chooses it\n"
    )
    assert not (tmp_path / ".venv").exists()


@pytest.mark.parametrize("version", SUPPORTED)
def test_a_supported_version_beside_another_one_is_found(version: str, tmp_path: Path) -> None:
    result = installed(tmp_path, "3.15", version)
    assert (result.returncode, result.stderr.splitlines()) == taken(version, f"{tmp_path}/bin/python{version}")


def test_the_versions_are_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11,<3.15"
    prefix = "Programming Language :: Python :: 3."
    classified = [one.removeprefix(prefix) for one in project["classifiers"] if one.startswith(prefix)]
    assert tuple(f"3.{minor}" for minor in classified) == SUPPORTED
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"Python (3\.\d+ to 3\.\d+)", readme) == ["3.11 to 3.14"]
