"""FuseSoC lints and simulates a package from an empty folder, and refuses what is broken."""

import re
import subprocess
import sysconfig
from pathlib import Path

import pytest
from tests.gen.output.packages.made import SPECIFICATIONS, called, design_of, unpacked
from tests.suite.extras import needs

from sosmith.gen.output.packages.package import packed
from sosmith.gen.output.packages.vlnv import Vlnv
from sosmith.model.errors import SpecificationError

pytestmark = needs("fusesoc")

FUSESOC = Path(sysconfig.get_path("scripts")) / "fusesoc"


def run(target: str, name: str, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run a target of the package in `folder`, from an empty folder beside it."""
    empty = folder / "empty"
    empty.mkdir(exist_ok=True)
    command = ["--cores-root", str(folder), "run", *options, "--target", target, f"user:sosmith:{name}:1.0"]
    return called(FUSESOC, *command, at=empty, simulator="verilator" if target == "lint" else "icarus")


@pytest.mark.slow
@pytest.mark.parametrize("name", SPECIFICATIONS)
def test_lint(name: str, tmp_path: Path) -> None:
    result = run("lint", name, unpacked(name, tmp_path))
    assert result.returncode == 0, result.stderr
    assert "--lint-only" in "".join(path.read_text(encoding="utf-8") for path in tmp_path.glob("empty/**/*.vc"))
    assert "%Warning" not in result.stdout + result.stderr


@pytest.mark.slow
def test_lint_reports_what_is_not_waived(tmp_path: Path) -> None:
    sv = unpacked("plain", tmp_path) / "core" / "plain.sv"
    text, count = re.subn(r"assign m_axis_tdata = .*;", "", sv.read_text(encoding="utf-8"))
    assert count == 1
    sv.write_text(text, encoding="utf-8")
    result = run("lint", "plain", tmp_path)
    assert result.returncode != 0
    assert "%Warning-UNDRIVEN" in result.stdout + result.stderr


def test_simulation(tmp_path: Path) -> None:
    result = run("sim", "plain", unpacked("plain", tmp_path))
    assert result.returncode == 0, result.stderr
    assert re.search(r"^PASS: \d+ samples, 0 mismatches$", result.stdout, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize(("target", "tool"), [("sim_verilator", "--binary"), ("synth", "synth_ice40")])
def test_other_targets_are_set_up(target: str, tool: str, tmp_path: Path) -> None:
    """The Yosys of these tests lacks Tcl, which FuseSoC's script for it needs, so that it is set up, not run."""
    result = run(target, "plain", unpacked("plain", tmp_path), "--setup")
    assert result.returncode == 0, result.stderr
    written = "".join(path.read_text(encoding="utf-8") for path in tmp_path.glob("empty/**/*") if path.is_file())
    assert tool in written


def test_the_name_is_the_one_asked_for() -> None:
    texts = packed(design_of("plain").core, vlnv=Vlnv.read("example.org:filters:smooth:2.1-rc1"))
    assert '\nname: "example.org:filters:smooth:2.1-rc1"\n' in texts["plain.core"]
    assert "<ipxact:vendor>example.org</ipxact:vendor>" in texts["ip_xact/plain.xml"]


@pytest.mark.parametrize("text", ["smooth", "a:b:c:d", "a:b:c:1:2", "a::c:1", "a b:c:d:1"])
def test_a_wrong_name_is_refused(text: str) -> None:
    expected = f"the vlnv must be vendor:library:name:version, such as example.org:filters:smooth:1.0, not {text}"
    with pytest.raises(SpecificationError, match=f"^{re.escape(expected)}$"):
        Vlnv.read(text)
