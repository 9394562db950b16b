"""The package of a decimated instrument: hardware and C model on its bench; several channels are refused."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.gen.word_lengths.decimated import locomotive, small

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.packages.package import package, packed
from sosmith.model.errors import SpecificationError


@pytest.mark.slow
@pytest.mark.parametrize(
    "design", [small, pytest.param(lambda: locomotive(core="instrument"), id="locomotive", marks=pytest.mark.slow)]
)
def test_the_bench_passes(design: Callable[[], CoreDesign], tmp_path: Path) -> None:
    """The calibration takes so many clocks for each sample that results are far apart."""
    package(design(), tmp_path)
    for target in ("icarus", "c"):
        command = ["make", "-s", "-C", str(tmp_path / "bench"), target]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
        assert found.returncode == 0, found.stdout + found.stderr
        assert re.search(r"^PASS: \d+ results, 0 mismatches$", found.stdout, re.MULTILINE)


def refused(sentence: str) -> pytest.RaisesExc[SpecificationError]:
    return pytest.raises(SpecificationError, match=f"^{re.escape(sentence)}$")


@pytest.mark.slow
def test_several_channels_are_refused() -> None:
    made = small("channels = 3\n")
    with refused("slight.toml: not yet available: channels must be 1 with filter.decimate in a package, not 3"):
        packed(made)
