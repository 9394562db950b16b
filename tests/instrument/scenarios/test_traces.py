"""Input signals of a core: made without any simulator."""

import subprocess
import sys

import pytest


@pytest.mark.slow
def test_no_simulator_is_imported() -> None:
    listed = "[m for m in sys.modules if m.startswith(('sosmith.sim', 'cocotb'))]"
    code = f"import sys, sosmith.instrument.scenarios.traces; print({listed})"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
