"""The command `verify` with goals for solvers: a text for each register, and what it needs."""

import json
from pathlib import Path

from tests.commands.invocation import Invocation
from tests.verify.small_specifications import NARROW

generate, verify = Invocation("generate"), Invocation("verify", columns=200)


def test_one_text_is_written_for_each_register(tmp_path: Path) -> None:
    spec, core, goals = tmp_path / "plain.toml", tmp_path / "core", tmp_path / "goals"
    spec.write_text(NARROW + 'hardware.architecture = "parallel"\n', encoding="utf-8")
    generate.good(str(spec), "-o", str(core))
    certificate = str(core / "plain.certificate.json")
    said = verify.good(certificate, "--files", str(core), "--smt", str(goals))
    written = sorted(path.name for path in goals.iterdir())
    assert f"written: {len(written)} goals in {goals}, to be unsat in any solver of QF_BV" in said.stdout
    assert {"section0.v1.smt2", "m_axis_tdata.smt2"} <= set(written)
    again = json.loads(verify.good(certificate, "--files", str(core), "--smt", str(goals), "--json").stdout)
    assert sorted(Path(path).name for path in again["smt_files"]) == written
    assert json.loads(verify.good(certificate, "--json").stdout)["smt_files"] == []


def test_goals_need_the_files(tmp_path: Path) -> None:
    result = verify.run("none.json", "--smt", str(tmp_path))
    assert result.exit_code == 2
    assert "--smt must have --files, the folder with the SystemVerilog" in result.output
