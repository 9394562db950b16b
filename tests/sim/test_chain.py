"""Chains in the simulators: all cores with the top, with random handshakes, against the integer models in a row."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.gen.chain import rising
from tests.gen.chain.chains import PLAIN, draw, instrument, stimulus
from tests.gen.chain.rising import SHAPES

import sosmith
from sosmith.gen.chain.joints import flags
from sosmith.gen.chain.rates import results_of
from sosmith.sim import chain as simulation

SEEDS = range(24)
FEW = (3,)
CASES = [pytest.param(seed, marks=[] if seed in FEW else pytest.mark.slow) for seed in SEEDS]


@pytest.mark.slow
@pytest.mark.parametrize("simulator", ["icarus", "verilator"])
@pytest.mark.parametrize("seed", CASES)
def test_the_hardware_equals_the_models(seed: int, simulator: str, tmp_path: Path) -> None:
    chain = sosmith.design_chain(draw(seed))
    codes = stimulus(chain, 700, seed)
    (port,) = chain.core.spec.base.inputs
    report = chain.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator=simulator, seed=seed)
    assert report.bit_exact
    assert report.passed
    assert report.summary["samples"] == -(-700 // chain.factor) * chain.core.spec.base.channels
    assert report.summary["error"]["max_abs"] <= report.summary["error"]["bound"] == float(chain.bound)
    assert (tmp_path / "report.html").read_text(encoding="utf-8").count("<svg") == 2


RISING = [
    pytest.param(seed, simulator, marks=[] if (seed, simulator) == (0, "icarus") else pytest.mark.slow)
    for simulator, seeds in (("icarus", range(len(SHAPES))), ("verilator", range(1, len(SHAPES), 2)))
    for seed in seeds
]


@pytest.mark.parametrize(("seed", "simulator"), RISING)
def test_the_hardware_of_a_chain_that_interpolates_equals_the_models(seed: int, simulator: str, tmp_path: Path) -> None:
    """With random handshakes, and a reset in mid-stream."""
    chain = sosmith.design_chain(rising.draw(seed))
    codes = rising.stimulus(chain, 60, seed)
    (port,) = chain.core.spec.base.inputs
    report = chain.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator=simulator, seed=seed)
    assert report.bit_exact
    assert report.passed
    assert report.summary["samples"] == results_of(chain.core.rates, 60) * codes.shape[1]


@pytest.mark.slow
def test_a_stage_whose_results_are_in_another_order_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = simulation.whole_text

    def crossed(design: Any, directory: Path) -> str:
        text = whole(design, directory)
        assert "is0 ? i0_tdata" in text
        return text.replace("is0 ? i0_tdata", "is0 ? i1_tdata")

    monkeypatch.setattr(simulation, "whole_text", crossed)
    stages = [rising.UP["stage"][0] | {"architecture": "parallel"}, *rising.UP["stage"][1:]]
    chain = sosmith.design_chain(rising.UP | {"stage": stages})
    codes = rising.stimulus(chain, 30, 1)
    (port,) = chain.core.spec.base.inputs
    report = chain.simulate({"x": port.decode(codes[:, 0])}, folder=tmp_path, simulator="icarus")
    assert not report.bit_exact


@pytest.mark.slow
def test_a_calibration_before_a_filter(tmp_path: Path) -> None:
    chain = sosmith.design_chain(instrument())
    volts, degrees = (
        np.linspace(port.lowest, port.highest, 200).astype(np.int64) for port in chain.core.spec.base.inputs
    )
    results = chain.run_codes(voltage=volts, temperature=degrees[::-1].copy())
    report = chain.simulate(
        {
            port.name: port.decode(codes)
            for port, codes in zip(chain.core.spec.base.inputs, (volts, degrees[::-1]), strict=True)
        },
        folder=tmp_path,
        simulator="icarus",
    )
    assert report.passed
    assert np.array_equal(report.run.received[:, 0], results)


@pytest.mark.slow
def test_a_fault_of_an_early_stage_reaches_every_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stage whose flags say so from one of its results on: so do those of the chain from the same sample on."""
    whole = simulation.whole_text

    def faulty(design: Any, directory: Path) -> str:
        text = whole(design, directory)
        assert ".stage_cal_tuser(stage_cal_tuser)" in text
        return text.replace(
            ".stage_cal_tuser(stage_cal_tuser)", f".stage_cal_tuser({{1'b0, stage_cal_tdata[{bit}], 6'b0}})"
        )

    monkeypatch.setattr(simulation, "whole_text", faulty)
    tree = instrument()
    tree["stage"][0]["protect"] = "detect"
    chain = sosmith.design_chain(tree)
    volts = np.repeat([0.01, 9.9], 20)
    ports = chain.core.spec.base.inputs
    codes = np.stack([ports[0].encode(volts), ports[1].encode(np.full(40, 20.0))], axis=1)
    between = chain.core.stages[0].design.datapath.compute(codes)
    bit = int(~between[0] & between[-1] & -(~between[0] & between[-1])).bit_length() - 1
    report = chain.simulate({"voltage": volts, "temperature": [20.0] * 40}, folder=tmp_path, simulator="icarus")
    wrong = int((between[::2] >> bit & 1).sum())
    assert 0 < wrong < len(between) // 2
    assert wrong <= report.summary["mismatches"] <= wrong + 2  # a result on its way may already say so


@pytest.mark.slow
@pytest.mark.parametrize(("protect", "core"), [("detect", 0), ("detect", 1), ("correct", 0)])
def test_a_wrong_bit_in_a_core_of_several(
    protect: str, core: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples in a ring change in mid-stream: from one on all results have the flag, or they are corrected."""
    whole, compared, seen = simulation.whole_text, simulation.run_of, dict[str, Any]()

    def upset(design: Any, directory: Path) -> str:
        text = whole(design, directory)
        start = text.index(f"module rx_fill_p{core}(")
        memory = re.compile(r"reg \[\d+:0\] ring_first_memory \[(\d+):0\];").search(text, start)
        assert memory is not None
        change = "ring_first_memory[at] = ring_first_memory[at] ^ 1;"
        loop = f"if (hits == 190) for (at = 0; at <= {memory[1]}; at = at + 1) {change}"
        counter = f" integer hits = 0, at; always @(posedge aclk) if (taken) begin hits = hits + 1; {loop} end"
        end = text.index("endmodule", start)
        return f"{text[:end]}{counter}\n{text[end:]}"

    def run_of(design: Any, codes: Any, received: Any, status: Any) -> Any:
        seen["wrong"] = (design.compute_with_status(codes)[1] ^ status) >> 6
        return compared(design, codes, received, status)

    monkeypatch.setattr(simulation, "whole_text", upset)
    monkeypatch.setattr(simulation, "run_of", run_of)
    stages = [rising.UP["stage"][0] | {"protect": protect}, *rising.UP["stage"][1:]]
    chain = sosmith.design_chain(rising.UP | {"stage": stages})
    codes = rising.stimulus(chain, 200, 1)
    (port,) = chain.core.spec.base.inputs
    report = chain.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator="icarus")
    first = int(seen["wrong"][:, 0].argmax())
    if protect == "correct":
        assert report.passed
    else:
        assert 800 < first < 1590
        assert seen["wrong"][first:].all()
        assert report.summary["mismatches"] == 1600 - first


@pytest.mark.slow
@pytest.mark.parametrize("start", ["steady", "zero"])
def test_an_upset_in_the_decimator_of_a_stage_is_flagged_and_forgotten(
    start: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bit of an integrator is turned over with the sample of number 400; no result of the chain is lost."""
    whole, loaded = simulation.whole_text, "else if (enters) sum1 <= sum1_next[15:0];"

    def upset(design: Any, directory: Path) -> str:
        text = whole(design, directory)
        assert text.count(loaded) == 1
        counter = (
            "reg [9:0] hits = 0;\n  always @(posedge front_clk) if (enters) hits <= hits + 1;\n  reg [15:0] sum1 ="
        )
        assert text.count("reg [15:0] sum1 =") == 1
        return text.replace(loaded, loaded.replace(";", " ^ (hits == 400);")).replace("reg [15:0] sum1 =", counter)

    monkeypatch.setattr(simulation, "whole_text", upset)
    low = {"name": "slow", "kind": "iir", "family": "butterworth", "order": 2, "cutoff": 200.0, "decimate": 4}
    out = {"name": "out", "kind": "fir", "taps": [0.25, 0.5, 0.25], "decimate": 2}
    tree = PLAIN | {"stage": [low, out], "hardware": {"protect": "detect", "start": start}}
    chain = sosmith.design_chain(tree)
    codes = stimulus(chain, 800, 1)
    (port,) = chain.core.spec.base.inputs
    report = chain.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator="icarus", seed=3)
    wrong = np.flatnonzero(report.run.received[:, 0] != report.run.expected[:, 0])
    first = 400 // chain.factor
    assert report.summary["samples"] == 100
    assert first - 16 < wrong[0] < wrong[-1] < first + 16
    assert len(report.run.received) - wrong[0] <= report.summary["mismatches"] <= 100 - wrong[0] + 4  # all are flagged


@pytest.mark.slow
def test_a_shallow_queue_of_flags_is_slow_and_not_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pipelines hold more results than two entries are for, so that the gate holds samples back again and again."""
    tree = PLAIN | {"stage": [{"name": f"s{k}", "kind": "fir", "taps": [0.25, 0.5, 0.25]} for k in range(4)]}
    tree |= {"hardware": {"architecture": "parallel"}}
    chain = sosmith.design_chain(tree)
    codes = stimulus(chain, 400, 1)
    (port,) = chain.core.spec.base.inputs
    clocks = []
    for depth in (flags._depth(chain.core), 2):
        monkeypatch.setattr(flags, "_depth", lambda design, depth=depth: depth)
        report = chain.simulate({"x": port.decode(codes)}, folder=tmp_path, simulator="icarus", idle=0.0, stall=0.2)
        assert report.passed
        sosmith.ChainCertificate.load(tmp_path / "rx.certificate.json").verify(files=tmp_path)
        clocks.append(report.summary["cycles"])
    assert clocks[1] > 1.5 * clocks[0]


def test_a_core_that_gives_another_result_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A top in which a stage is taken twice is no chain, and the run says so."""
    whole = simulation.whole_text

    def crossed(design: Any, directory: Path) -> str:
        return whole(design, directory).replace(
            ".m_axis_tdata(m_axis_tdata)", ".m_axis_tdata({m_axis_tdata[14:0], m_axis_tdata[15]})"
        )

    monkeypatch.setattr(simulation, "whole_text", crossed)
    chain = sosmith.design_chain(instrument())
    report = chain.simulate({"voltage": [1.0] * 8, "temperature": [20.0] * 8}, folder=tmp_path, simulator="icarus")
    assert not report.passed
    assert report.summary["mismatches"] > 0
    assert "differs from the integer models" in report.summary["shortfalls"][0]
