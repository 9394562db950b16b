"""The script `./run`: which versions of Python it takes, and what it says of the others."""

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest
from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
SUPPORTED = ("3.11", "3.12", "3.13", "3.14")
COMMANDS = ("cat", "cksum", "dirname", "echo", "sed", "sort", "xargs")
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
    for name in ("run", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / "requirements", tmp_path / "requirements")
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


def test_the_environment_of_another_checkout_is_left_alone(tmp_path: Path) -> None:
    other, ours = tmp_path / "other", tmp_path / "ours"
    (other / ".venv").mkdir(parents=True)
    (other / "run").touch()
    (other / ".venv" / ".ready").write_text(f"1 2\n{other}\nPython 3.11.0 test")
    ours.mkdir()
    (ours / ".venv").symlink_to(other / ".venv")
    result = installed(ours, "3.11")
    assert result.returncode == 3
    assert result.stderr == (
        f"run: .venv must be this checkout's own, not a link to that of {other}; remove the link: 'rm .venv'\n"
    )
    assert (other / ".venv" / ".ready").exists()


def test_the_versions_are_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11,<3.15"
    prefix = "Programming Language :: Python :: 3."
    classified = [one.removeprefix(prefix) for one in project["classifiers"] if one.startswith(prefix)]
    assert tuple(f"3.{minor}" for minor in classified) == SUPPORTED
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"Python (3\.\d+ to 3\.\d+)", readme) == ["3.11 to 3.14"]


def required(level: str) -> dict[str, Requirement]:
    """Return what a file in requirements/ pins, by name."""
    text = (ROOT / "requirements" / f"{level}.txt").read_text(encoding="utf-8")
    entries = [Requirement(one.split(" \\\n")[0]) for one in re.split(r"\n(?=\S)", text.strip())]
    return {canonicalize_name(one.name): one for one in entries}


def test_every_package_has_hashes_and_the_version_of_the_constraints() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").split()
    pins = {canonicalize_name(one.name): str(one.specifier) for one in map(Requirement, lines)}
    found: dict[str, str] = {}
    for path in (ROOT / "requirements").glob("*.txt"):
        text = path.read_text(encoding="utf-8")
        assert not re.sub(r"\S+==[^\n]+( \\\n    --hash=sha256:[0-9a-f]{64})+\n", "", text)
        found |= {name: str(one.specifier) for name, one in required(path.stem).items()}
    assert found == pins


@pytest.mark.parametrize(("extras", "files"), [((), ("base",)), (("boards",), ("base", "boards")), (("test",), ())])
def test_what_run_installs_is_all_that_the_package_needs(extras: tuple[str, ...], files: tuple[str, ...]) -> None:
    names = {name for level in ("build", *(files or ("base", "boards", "test"))) for name in required(level)}
    assert set(needed("sosmith", extras)) <= names


def needed(name: str, extras: tuple[str, ...], seen: frozenset[str] = frozenset()) -> Iterator[str]:
    """Yield what an installed package needs, and what that needs, by the metadata of what is installed."""
    for text in metadata.requires(name) or ():
        one = Requirement(text)
        if one.marker is not None and not any(
            one.marker.evaluate({**default_environment(), "extra": extra}) for extra in ("", *extras)
        ):
            continue
        below = canonicalize_name(one.name)
        if below != "sosmith":
            yield below
        if f"{below}{sorted(one.extras)}" not in seen:
            seen |= {f"{below}{sorted(one.extras)}"}
            yield from needed(one.name, tuple(one.extras), seen)
