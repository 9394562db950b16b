"""A package: the same bytes on every run, its core the one that `generate` writes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.gen.output.packages.made import SPECIFICATIONS, design_of, package_of

import sosmith
from sosmith.gen.output.generate import generated

PACKAGE = Invocation("package")


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    """The second run is another process with another hash seed."""
    spec = tmp_path / "plain.toml"
    spec.write_text(sosmith.Specification.load(SPECIFICATIONS["plain"]).toml(), encoding="utf-8")
    first = PACKAGE.good(str(spec), "-o", str(tmp_path / "one")).stdout.split()
    subprocess.run(
        [sys.executable, "-m", "sosmith.cli", "package", str(spec), "-o", str(tmp_path / "two")],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "4242"},
    )
    paths = [Path(path).relative_to(tmp_path / "one") for path in first]
    assert len(paths) > 10
    for path in paths:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()


@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_the_core_is_the_one_that_generate_writes(name: str) -> None:
    core = {path.removeprefix("core/"): text for path, text in package_of(name).items() if path.startswith("core/")}
    assert core == generated(design_of(name).core)
