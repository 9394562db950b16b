"""Commands that run the hardware in a simulator, and make what drives it: `simulate`, `emulate`, `demo`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import click
from rich.markup import escape

from sosmith.commands.design_tables import print_design
from sosmith.commands.options import (
    BOARD,
    CORE,
    REALIZATION,
    SECONDS,
    SEED,
    SPEC,
    WIDTHS_OF,
    board_named,
    default_folder,
)
from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.fpga.boards import BOARDS
from sosmith.gen.report.report import write_report
from sosmith.gen.specification.specification import example, load
from sosmith.gen.stimuli import bench_of, default_scenario, is_scenario_file, notes_on, traces_for
from sosmith.model.errors import SpecificationError
from sosmith.model.scenarios.catalogue import SCENARIOS
from sosmith.model.scenarios.depot_measurements import measurements_csv, measurements_of
from sosmith.model.scenarios.file import load_scenario
from sosmith.model.text_files import write_files
from sosmith.model.traces.trace_file import traces_csv, write_traces
from sosmith.sim.simulation import simulate
from sosmith.sim.simulators import check_name
from sosmith.terminal import (
    JSON_OPTION,
    Step,
    TableConsole,
    new_table,
    note,
    output_option,
    print_json,
    reader_may_leave,
    show_progress,
)


class _Share(click.FloatRange):
    """Share of clocks; unlike its parent it refuses NaN."""

    def __init__(self) -> None:
        super().__init__(0, 0.99)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        share = super().convert(value, param, ctx)
        if math.isnan(share):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return share


@click.command("simulate")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option(
    "--trace",
    "source",
    metavar="FILE.csv|FILE.toml|SCENARIO",
    help="What drives the inputs.  [default: wear_ramp, or sweep without a calibration]",
)
@click.option(
    "--simulator",
    type=click.Choice(["verilator", "icarus", "cxxrtl"]),
    default="verilator",
    show_default=True,
)
@click.option(
    "--idle",
    type=_Share(),
    default=0.3,
    show_default=True,
    help="Share of clocks without an input sample.",
)
@click.option(
    "--stall",
    type=_Share(),
    default=0.3,
    show_default=True,
    help="Share of clocks with the output held up.",
)
@click.option(
    "--gates",
    metavar="BOARD",
    help="Run the netlist that Yosys makes of it for the FPGA of a board instead: "
    f"{', '.join(BOARDS)}. Takes seconds to synthesize, and runs slower.",
)
@click.option("--waves", is_flag=True, help="Write a waveform (VCD) too.")
@SECONDS
@SEED
@JSON_OPTION
@output_option("Folder for the files.  [default: build/<name>]")
def simulate_command(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    source: str | None,
    simulator: str,
    idle: float,
    stall: float,
    gates: str | None,
    waves: bool,
    seconds: float | None,
    seed: int,
    as_json: bool,
    output: Path | None,
) -> None:
    """Run the generated hardware of SPEC under cocotb and report its accuracy.

    The SystemVerilog runs with random idle and back-pressure on both streams. Every sample is compared with the
    integer model for equality, and with the double-precision golden chain for the error. Writes report.json and
    report.html; exits with 1 if the result falls short. `sosmith emulate SPEC` lists the scenarios.

    With --gates, the same bench runs the cells of an FPGA, their flip-flops at random when it starts, and an automatic
    choice of the architecture is made for that board.
    """
    check_name(simulator)  # before anything takes time
    netlist_for = board_named(gates)
    target = board_named(board) or netlist_for
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
        summary, folder = _simulate(
            made,
            step,
            source,
            output,
            seconds,
            simulator=simulator,
            seed=seed,
            idle=idle,
            stall=stall,
            gates=netlist_for,
            waves=waves,
        )
    _finish(summary, folder, as_json=as_json)


@click.command("emulate")
@SPEC
@click.argument("scenario", required=False, metavar="[SCENARIO|FILE.toml]")
@CORE
@SECONDS
@click.option(
    "--measurements",
    is_flag=True,
    help="Write the depot's measurements of FILE.toml instead, for `sosmith calibrate add`.",
)
@SEED
@output_option("CSV file to write.  [default: stdout]")
def emulate_command(
    spec: Path,
    scenario: str | None,
    core: str | None,
    seconds: float | None,
    measurements: bool,
    seed: int,
    output: Path | None,
) -> None:
    """Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios that fit.

    A core with several channels gets the rows of all of them, by the column channel.

    A scenario is a built-in one by name, or a file that describes days of operation: examples/scenarios/ holds some,
    and docs/sensors.md says what can be in them.
    """
    if measurements:
        if seconds is not None:
            raise SpecificationError("--seconds must come with a scenario's name, not with --measurements")
        _write_measurements(spec, scenario, seed, output)
        return
    with show_progress() as step:
        made = design_core(load(spec), core=core, progress=step)
        if scenario is None:
            _list_scenarios(made)
            return
        step(f"emulating {scenario}")
        traces = traces_for(made, _known_scenario(made, scenario), seed=seed, seconds=seconds)
        notes = notes_on(made, scenario)
        if output is not None:
            write_traces(output, traces)
    if output is None:
        click.echo(traces_csv(traces), nl=False)
    else:
        channels = f" of each of {len(traces)} channels" if len(traces) > 1 else ""
        note(f"wrote {output}: {len(traces[0])} samples{channels} at {float(traces[0].sample_rate):g} Hz")
    for sentence in notes:
        note(f"note: {sentence}")


@click.command()
@output_option("Folder for the files.  [default: build/demo]")
@SEED
def demo(output: Path | None, seed: int) -> None:
    """Walk the whole road on the built-in example: a locomotive's flange wear at 100 Hz.

    Designs the filter, generates the hardware, runs it in the simulator on an emulated wear run, and writes the
    report.
    """
    folder = output or Path("build/demo")
    with show_progress() as step:
        step("writing the example specification")
        (spec,) = write_files(folder, {"flange_wear.toml": example()})
        made = design_core(load(spec), progress=step)
        summary, folder = _simulate(
            made, step, None, folder, None, simulator="verilator", seed=seed, idle=0.3, stall=0.3, waves=False
        )
    print_design(made, brief=True)
    _finish(summary, folder, as_json=False)


def _simulate(
    made: CoreDesign,
    step: Step,
    source: str | None,
    output: Path | None,
    seconds: float | None,
    **options: Any,
) -> tuple[dict[str, Any], Path]:
    folder = output or default_folder(made)
    chosen = source or default_scenario(made)
    step(f"trace {chosen}")
    traces = traces_for(made, chosen, seed=options["seed"], seconds=seconds)
    evidence = simulate(made, traces, folder, progress=step, **options)
    for sentence in notes_on(made, chosen):
        note(f"note: {sentence}")
    step("writing the report")
    return write_report(evidence, folder), folder


def _finish(summary: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    with reader_may_leave():
        if as_json:
            print_json(summary)
        else:
            _print_summary(summary)
    note(f"report: {(folder / 'report.html').resolve().as_uri()}")
    if not summary["passed"]:
        sys.exit(1)


def _known_scenario(made: CoreDesign, name: str) -> str:
    if name not in SCENARIOS and not is_scenario_file(name):
        fitting = ", ".join(_fitting(made))
        raise SpecificationError(
            f"the scenario must be one of {fitting}, or a file whose name ends in .toml, not {name}"
        )
    return name


def _fitting(made: CoreDesign) -> list[str]:
    kind = bench_of(made).kind
    return [name for name, scenario in SCENARIOS.items() if kind in scenario.kinds]


def _list_scenarios(made: CoreDesign) -> None:
    bench = bench_of(made)
    table = new_table(f"Scenarios for {made.spec.name}", ["name", "seconds", "what it is"])
    for name in _fitting(made):
        table.add_row(name, f"{SCENARIOS[name].default_seconds(bench):.4g}", SCENARIOS[name].description)
    TableConsole().print(table)
    note("a file can take a name's place: examples/scenarios/ holds some, docs/sensors.md says what can be in them")


def _write_measurements(spec: Path, source: str | None, seed: int, output: Path | None) -> None:
    """Write what is measured by hand in a scenario file's depot, as CSV."""
    if source is None or not is_scenario_file(source):
        raise SpecificationError(f"--measurements must come with a scenario file (TOML), not {source or 'without one'}")
    load(spec)  # so that a slip in it is not found out later
    rows = measurements_of(load_scenario(Path(source)), seed)
    text = measurements_csv(rows)
    if output is None:
        click.echo(text, nl=False)
        return
    write_files(output.parent, {output.name: text})
    note(f"wrote {output}: {len(rows)} measurements")


def _print_summary(summary: dict[str, Any]) -> None:
    unit = escape(f" {summary['error']['unit']}".rstrip())
    verdict = "[bold green]passed[/]" if summary["passed"] else "[bold red]fell short[/]"
    table = new_table(f"{summary['name']}: {verdict}", ["", ""])
    exact = (
        "yes, every one"
        if summary["bit_exact"]
        else f"no: {summary['mismatches']} differ, the first at {summary['first_mismatch']}"
    )
    table.add_row("hardware equals integer model", f"{exact} of {summary['samples']} samples")
    error = summary["error"]
    table.add_row(
        "largest error against golden",
        f"{error['max_abs']:.4g}{unit} = {error['max_lsb']:.3f} LSB (bound {error['bound']:.4g}{unit})",
    )
    if summary["sqnr_db"] is not None:
        table.add_row("signal to quantization noise", f"{summary['sqnr_db']:.1f} dB")
    accuracy = summary["accuracy_percent"]
    if accuracy["hardware"] is not None:
        measured = ", ".join(f"{chain} {percent:.4f} %" for chain, percent in accuracy.items())
        table.add_row("accuracy by the paper's measure", measured)
    for other in summary["alternatives"]:
        table.add_row(f"  {other['name']} at the same widths", f"largest error {other['max_abs']:.4g}{unit}")
    for reason in summary["shortfalls"]:
        table.add_row("[red]short[/]", escape(reason))
    gates = "" if summary["gates"] is None else f", the netlist for {summary['gates']}"
    speed = f"{summary['simulator']}{gates}, {summary['cycles']} clocks at {summary['cycles_per_second']:.3g} a second"
    table.add_row("simulated in", speed)
    TableConsole().print(table)
