"""The static types fit together."""

import subprocess
import sys

import pytest
from tests.house import ROOT


@pytest.mark.first
def test_the_package_has_no_type_errors() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-color-output"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
