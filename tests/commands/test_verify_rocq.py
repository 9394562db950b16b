"""The command `verify` with Rocq: what its kernel accepts, what is written for it, and a machine without it."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.verify.rocq.small import GRID, needs_coqc, small, with_gain

from sosmith.model.errors import ShortfallError, ToolError
from sosmith.verify.certificate_file import certificate_text

command = Invocation("verify", columns=200)


@pytest.fixture
def path(tmp_path: Path) -> str:
    place = tmp_path / "small.certificate.json"
    place.write_text(certificate_text(small(order=1)))
    return str(place)


@needs_coqc
@pytest.mark.slow
def test_each_claim_is_reported(path: str) -> None:
    result = command.run(path, "--rocq")
    assert result.exit_code == 0
    assert "checked by Rocq: recursion_gain_0: section 0: gain of its recursion at most " in result.stdout
    assert "axioms: ClassicalDedekindReals.sig_forall_dec, " in result.stdout
    assert "taken as given: the certificate's graph, exact filter and exact calibration" in result.stdout
    assert "not checked by Rocq: " not in result.stdout
    said = json.loads(command.good(path, "--rocq", "--json").stdout)["rocq"]
    assert {"recursion_gain_0", "peak_gain_0_0"} <= said["claims"].keys()


@needs_coqc
@pytest.mark.slow
def test_what_is_written_is_checked_elsewhere(path: str, tmp_path: Path) -> None:
    folder = tmp_path / "theories"
    assert f"written: 18 files for Rocq in {folder}" in command.good(path, "--export", str(folder)).stdout
    assert json.loads(command.good(path, "--json").stdout)["rocq"] is None
    made = subprocess.run(["make", "-C", str(folder)], capture_output=True, text=True, check=True)
    assert made.stdout.count("Axioms:") == 1
    claims = folder / "Claims.v"
    claims.write_text(claims.read_text().replace("18446744073709551617", "18446744073709551616", 1))
    assert subprocess.run(["make", "-C", str(folder)], capture_output=True, check=False).returncode == 2


def test_without_rocq_it_says_how_to_get_it(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    result = command.refused(
        "the option --rocq must find coqc, the compiler of Rocq, which is not installed: on Debian and Ubuntu, "
        "apt-get install --no-install-recommends coq",
        path,
        "--rocq",
        kind=ToolError,
    )
    assert isinstance(result.exception, ToolError)
    assert result.exception.exit_status == 3


def test_what_the_verifier_rejects_never_gets_to_rocq(path: str) -> None:
    made = small(order=1)
    claimed = made.claims.sections[0].recursion_gain
    Path(path).write_text(certificate_text(with_gain(made, 0, recursion_gain=claimed - GRID)))
    assert isinstance(command.run(path, "--rocq").exception, ShortfallError)
