"""The generated SystemVerilog is read by Verilator's linter, Icarus and Yosys without an error."""

import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest
from tests.gen.designs import ALL, example_design
from tests.sim.lint import icarus_check, lint

from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.core import design_core
from sosmith.gen.fpga import yosys as program
from sosmith.gen.output.generate import generate
from sosmith.gen.output.packages.lint_waivers import WAIVERS
from sosmith.gen.specification.choices import CORES
from sosmith.model.errors import ShortfallError

FIRST = [
    ("audio_lowpass.toml", "filter", "df1", "parallel"),
    ("audio_lowpass.toml", "filter", "df1_ef2", "folded"),
    ("flange_wear_bench.toml", "calibration", "df1", "parallel"),
    ("flange_wear_bench.toml", "filter", "df1_ef2", "parallel"),
    ("flange_wear_bench.toml", "instrument", "df1_ef2", "serial"),
    ("flange_wear_bench.toml", "instrument", "df1_ef2", "folded"),
    ("flange_wear_locomotive.toml", "instrument", "df1_ef2", "parallel"),
]
"""Every architecture, core and realization once or more."""
EVERY = [
    (example, core, realization, "parallel")
    for example in ALL
    for core in (["filter"] if example.startswith("audio") else CORES)
    for realization in ("df1", "df1_ef2")
] + [
    (example, "filter" if example.startswith("audio") else "instrument", "df1_ef2", architecture)
    for example in ALL
    for architecture in ("folded", "serial")
]
VARIANTS = [*FIRST, *(variant for variant in EVERY if variant not in FIRST)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lint")


@cache
def emitted(folder: Path, example: str, core: str, realization: str, architecture: str) -> Path:
    made = example_design(example, core=core, realization=realization)
    made = replace(made, architecture=ARCHITECTURES[architecture](made.datapath))
    return generate(made, folder / f"{made.spec.name}_{core}_{realization}_{architecture}")[0]


@pytest.fixture(params=VARIANTS, ids="-".join)
def core(request: pytest.FixtureRequest, folder: Path) -> Path:
    return emitted(folder, *request.param)


@pytest.fixture
def locomotive(folder: Path) -> Path:
    return emitted(folder, "flange_wear_locomotive.toml", "instrument", "df1_ef2", "parallel")


def yosys(sv: Path) -> subprocess.CompletedProcess[str]:
    """Read with a current Yosys, which may see only files beside it: hence the working directory."""
    script = f"read_verilog -sv {sv.name}; hierarchy -check -top {sv.stem}; proc; check -assert"
    command = [*program.yosys_command(), "-q", "-p", script]
    return subprocess.run(command, cwd=sv.parent, capture_output=True, text=True, check=False)


@pytest.mark.sweep(2)
def test_verilator_has_no_warning_left(core: Path, tmp_path: Path) -> None:
    assert lint(core, core.stem, tmp_path) == []


@pytest.mark.sweep(3)
def test_icarus_has_no_warning(core: Path) -> None:
    assert icarus_check(core, core.stem) == []


@pytest.mark.sweep(2)
def test_yosys_finds_no_fault(core: Path) -> None:
    result = yosys(core)
    assert result.returncode == 0, result.stderr
    assert "Warning" not in result.stderr


@pytest.mark.parametrize("name", WAIVERS)
def test_every_waiver_is_needed(name: str, locomotive: Path, tmp_path: Path) -> None:
    remaining = lint(locomotive, locomotive.stem, tmp_path, waived=WAIVERS.keys() - {name})
    assert remaining
    assert {re.match(r"%Warning-(\w+): ", line)[1] for line in remaining} == {name}


def test_a_fault_that_only_the_linter_sees_is_reported(locomotive: Path, tmp_path: Path) -> None:
    text = locomotive.read_text(encoding="utf-8")
    text, count = re.subn(r"assign m_axis_tdata = .*;", "", text, count=1)
    assert count
    sv = tmp_path / locomotive.name
    sv.write_text(text, encoding="utf-8")
    (undriven,) = lint(sv, sv.stem, tmp_path)
    assert undriven.startswith("%Warning-UNDRIVEN: ")


def test_warnings_of_icarus_are_reported(locomotive: Path, tmp_path: Path) -> None:
    text = locomotive.read_text(encoding="utf-8")
    sv = tmp_path / locomotive.name
    sv.write_text(text.replace("  wire rst;\n", "", 1), encoding="utf-8")
    assert icarus_check(sv, sv.stem)[0].endswith("warning: implicit definition of wire 'rst'.")
    assert "Warning" in yosys(sv).stderr


BROKEN = {
    "an undeclared module": ("_output_buffer output_buffer (", "_nowhere output_buffer (", "nowhere"),
    "a syntax error": ("endmodule", "endmodul", "syntax error"),
}


@pytest.mark.parametrize(("old", "new", "message"), BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_refused(old: str, new: str, message: str, locomotive: Path, tmp_path: Path) -> None:
    text = locomotive.read_text(encoding="utf-8")
    assert old in text
    sv = tmp_path / locomotive.name
    sv.write_text(text.replace(old, new), encoding="utf-8")
    path = re.escape(str(sv))
    pattern = rf"^{path} must be taken by Verilator, not refused: %Error(-\w+)?: {path}:\d+:\d+: .*{message}.*$"
    with pytest.raises(ShortfallError, match=pattern):
        lint(sv, sv.stem, tmp_path)
    with pytest.raises(ShortfallError, match=rf"^{path} must be taken by Icarus, not refused: {path}:\d+: .*error.*$"):
        icarus_check(sv, sv.stem)
    assert yosys(sv).returncode


def test_a_loop_of_logic_is_found_by_yosys(locomotive: Path, tmp_path: Path) -> None:
    text = locomotive.read_text(encoding="utf-8")
    old = "  assign rst = ~ aresetn;\n"
    assert old in text
    sv = tmp_path / locomotive.name
    sv.write_text(text.replace(old, "  assign rst = ~ (aresetn & rst);\n", 1), encoding="utf-8")
    assert "logic loop" in yosys(sv).stderr


def test_a_wrong_top_is_refused(locomotive: Path, tmp_path: Path) -> None:
    with pytest.raises(ShortfallError, match=r" must be taken by Verilator, not refused: %Error: .*elsewhere"):
        lint(locomotive, "elsewhere", tmp_path)
    with pytest.raises(ShortfallError, match=r" must be taken by Icarus, not refused: .*elsewhere"):
        icarus_check(locomotive, "elsewhere")


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_reload_leaves_nothing_for_a_linter(architecture: str, tmp_path: Path) -> None:
    spec = example_design("flange_wear_bench.toml").spec
    hardware = replace(
        spec.hardware, architecture=architecture, realization="df1_ef2", clock=Fraction(10**8), reload=True
    )
    made = design_core(replace(spec, hardware=hardware))
    sv = generate(made, tmp_path)[0]
    assert lint(sv, sv.stem, tmp_path) == []
    assert icarus_check(sv, sv.stem) == []
