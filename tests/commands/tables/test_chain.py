"""The commands that take a chain of stages, and what they say where they do not."""

import json
from pathlib import Path

import pytest
from tests.commands.command_line import Command

CHAIN = """\
name = "rx"
sample_rate = 8000.0

[input.x]
bits = 8
range = [-1.0, 1.0]
signed = true

[[stage]]
name = "slow"
kind = "cic"
order = 2
decimate = 2

[[stage]]
name = "out"
kind = "fir"
taps = [0.25, 0.5, 0.25]

[output]
bits = 10
range = [-1.0, 1.0]
signed = true
"""


def test_a_chain_from_the_specification_to_the_proof(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    shown = sosmith("design", "rx.toml", "--plot", "rx.svg")
    assert (shown.status, Path("rx.svg").exists()) == (0, True)
    assert "End-to-end error budget" in shown.stdout
    tree = json.loads(sosmith("design", "rx.toml", "--json").stdout)
    assert [stage["name"] for stage in tree["stages"]] == ["slow", "out"]
    assert tree["folding"]["anywhere"]["gain"] > 0

    paths = sosmith("generate", "rx.toml", "-o", "rx").stdout.split()
    assert {"rx/rx.sv", "rx/rx.certificate.json", "rx/rx_out.certificate.json"} <= set(paths)
    proven = sosmith("verify", "rx/rx.certificate.json", "--files", "rx", "--spec", "rx.toml", "--json")
    assert proven.status == 0
    verdict = json.loads(proven.stdout)
    assert verdict["proven"]
    assert verdict["error_bound"] <= verdict["max_error"]
    assert "proven: chain: " in sosmith("verify", "rx/rx.certificate.json").stdout

    Path("rx/rx_out.sv").write_text(Path("rx/rx_out.sv").read_text() + "\n")
    refused = sosmith("verify", "rx/rx.certificate.json", "--files", "rx")
    assert refused.status == 1
    assert "stage out: " in refused.messages[-1]


@pytest.mark.slow
def test_a_chain_in_a_package(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    paths = sosmith("package", "rx.toml", "-o", "packed").stdout.split()
    assert {"packed/README.md", "packed/rx.core", "packed/core/rx.sv", "packed/bench/rx_bench.sv"} <= set(paths)
    refused = sosmith("package", "rx.toml", "--core", "filter")
    assert refused.status == 2


def test_other_coefficients_for_a_stage(sosmith: Command) -> None:
    filter_ = 'kind = "iir"\nfamily = "butterworth"\norder = 2\ncutoff = 400.0\nreload = true'
    text = CHAIN.replace('kind = "fir"\ntaps = [0.25, 0.5, 0.25]', filter_) + "max_error = 0.01\n"
    Path("rx.toml").write_text(text, encoding="utf-8")
    Path("other.toml").write_text(text.replace("400.0", "390.0"), encoding="utf-8")
    loaded = sosmith("reload", "rx.toml", "other.toml", "--reset", "-o", "set.json", "--json")
    assert loaded.status == 0, loaded.messages
    tree = json.loads(Path("set.json").read_text(encoding="utf-8"))
    assert tree == json.loads(loaded.stdout)
    assert (tree["name"], tree["chain"]["stage"]) == ("rx_out", "out")
    refused = sosmith("reload", "rx.toml", "other.toml", "--reset", "-o", "set.json", "--port", "nowhere")
    assert refused.status == 3
    assert "nowhere" in refused.messages[-1]


@pytest.mark.slow
def test_a_chain_in_a_simulator(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    run = sosmith("simulate", "rx.toml", "--simulator", "icarus", "--seconds", "0.2", "-o", "run", "--json")
    assert run.status == 0
    summary = json.loads(run.stdout)
    assert summary == json.loads(Path("run/report.json").read_text(encoding="utf-8"))
    assert summary["bit_exact"]
    assert summary["error"]["max_abs"] <= summary["error"]["bound"]


def test_options_of_a_single_core_are_refused(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    for command in (
        ("design", "--core", "filter"),
        ("generate", "--realization", "df1"),
        ("simulate", "--date", "2026-01-01"),
    ):
        refused = sosmith(command[0], "rx.toml", *command[1:])
        assert refused.status == 2
        assert refused.messages == [
            f"sosmith: error: {command[1]} must be left out with a chain of stages, as it is for a single core only"
        ]


def test_other_commands_say_that_they_take_no_chain(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    refused = sosmith("emulate", "rx.toml")
    assert refused.status == 2
    assert refused.messages[-1] == (
        "sosmith: error: rx.toml: not yet available: stage must be left out here, as only board, build, design, "
        "explore, generate, package, reload, simulate and verify take a chain: `sosmith generate` writes a "
        "specification of each stage beside the chain's files, for what takes a single core, not [a table, a table]"
    )


def test_a_stage_alone_goes_where_a_chain_does_not(sosmith: Command) -> None:
    Path("rx.toml").write_text(CHAIN, encoding="utf-8")
    sosmith("generate", "rx.toml", "-o", "rx")
    refused = sosmith("verify", "rx/rx.certificate.json", "--rebuild")
    assert refused.status == 2
    assert refused.messages[-1] == (
        "sosmith: error: --rebuild must be left out with a chain of stages, as it is for a single core only: give it "
        "with the certificate of each stage, such as rx/rx_slow.certificate.json"
    )
    assert sosmith("verify", "rx/rx_slow.certificate.json", "--spec", "rx/rx_slow.toml").status == 0
