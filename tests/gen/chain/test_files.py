"""The files of a chain: the same bytes each time, a C model that computes what the design does, a top to lint."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.gen.chain.chains import PLAIN, stimulus
from tests.sim.lint import icarus_check, lint

import sosmith
from sosmith.sim.chain import whole_text

MAIN = """
#include "rx.h"
#include <stdio.h>

int main(void)
{
    rx_state state;
    long long x;
    int64_t y;
    uint8_t status;
    rx_reset(&state);
    while (scanf("%lld", &x) == 1)
        if (rx_push(&state, x, &y, &status))
            printf("%lld %d\\n", (long long)y, status);
    return 0;
}
"""


@pytest.fixture(scope="module")
def chain() -> sosmith.Chain:
    return sosmith.design_chain(PLAIN)


@pytest.mark.slow
def test_two_runs_write_the_same_bytes(chain: sosmith.Chain, tmp_path: Path) -> None:
    first = {path.name: path.read_bytes() for path in chain.generate(tmp_path / "one")}
    again = {path.name: path.read_bytes() for path in sosmith.design_chain(PLAIN).generate(tmp_path / "two")}
    assert first == again
    assert len(first) == 5 + 7 * 3


def test_stages_have_the_architecture_that_each_asks_for(chain: sosmith.Chain) -> None:
    assert [stage.architecture for stage in chain.stages] == ["parallel", "parallel", "folded"]


@pytest.mark.slow
def test_names_of_nets_are_kept_in_all_stages(tmp_path: Path) -> None:
    sosmith.design_chain(PLAIN | {"hardware": {"keep": True}}).generate(tmp_path)
    for stage in PLAIN["stage"]:
        text = (tmp_path / f"rx_{stage['name']}.certificate.json").read_text(encoding="utf-8")
        assert json.loads(text)["about"]["item"]["keep"] is True


def test_the_c_model_computes_what_the_design_does(chain: sosmith.Chain, tmp_path: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("a C compiler is missing")
    chain.generate(tmp_path)
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    sources = [f"{name}.c" for name in ("main", "rx", *(stage.name for stage in chain.stages))]
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-o", "main"]
    subprocess.run([compiler, *options, *sources], cwd=tmp_path, check=True)
    codes = stimulus(chain, 500, 1)
    given = "\n".join(map(str, codes[:, 0].tolist()))
    printed = subprocess.run([tmp_path / "main"], input=given, capture_output=True, text=True, check=True).stdout
    results = np.array([list(map(int, line.split())) for line in printed.splitlines()])
    expected, status = chain.core.compute_with_status(codes[:, :, None])
    assert np.array_equal(results[:, 0], expected[:, 0])
    assert np.array_equal(results[:, 1], status[:, 0])


def test_the_top_is_taken_without_a_warning_but_for_flags_that_nobody_reads(
    chain: sosmith.Chain, tmp_path: Path
) -> None:
    chain.generate(tmp_path)
    path = tmp_path / "whole.sv"
    path.write_text(whole_text(chain.core, tmp_path), encoding="utf-8")
    warnings = lint(path, "rx", tmp_path)
    assert [line for line in warnings if "_tuser" not in line and "DECLFILENAME" not in line] == []
    assert icarus_check(path, "rx") == []


def test_a_picture_shows_the_chain_and_its_stages(chain: sosmith.Chain, tmp_path: Path) -> None:
    assert chain.plot(tmp_path / "rx.svg").read_text(encoding="utf-8").count("<svg") == 1
    with pytest.raises(sosmith.SpecificationError, match=r"the plot's name must end in \.svg or \.png, not \.pdf$"):
        chain.plot(tmp_path / "rx.pdf")
