"""The `sosmith` command: data goes to stdout, progress and messages to stderr.

Exit status: 0 good; 1 the result falls short; 2 bad usage or a bad specification; 3 a tool is missing or
failed; 130 interrupted.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from types import FrameType
from typing import Any

import click
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

import sosmith
from sosmith.gen.architecture import Architecture
from sosmith.gen.boards import BOARDS, Board, find_board
from sosmith.gen.certificate_file import Certificate, read_certificate
from sosmith.gen.comparison import column_names, comparison_json, comparison_page, load_report
from sosmith.gen.comparison import compare as compare_reports
from sosmith.gen.core import CORES, CoreDesign, design_core
from sosmith.gen.cost import cost_of
from sosmith.gen.generate import generate as generate_files
from sosmith.gen.limit_cycles import limit_cycles, recursions
from sosmith.gen.manifest import manifest, section_entries
from sosmith.gen.realizations import ERROR_FEEDBACK, REALIZATIONS
from sosmith.gen.report import write_report
from sosmith.gen.specification import example, load
from sosmith.gen.verification import RejectedError, Verdict
from sosmith.gen.verification import verify as verify_certificate
from sosmith.model.errors import SosmithError, SpecificationError, ToolError
from sosmith.model.program import Program
from sosmith.model.scenarios import SCENARIOS
from sosmith.model.text_files import write_files
from sosmith.sim.simulation import bench_of, default_scenario, simulate, traces_for

_LATER = ("build", "explore", "calibrate", "monitor", "board")
"""Commands that this version does not have yet."""

_INTERRUPTED = 130


class _Commands(click.Group):
    """Lists commands in the order of work and names those that are still to come."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _LATER:
            have = ", ".join(self.commands)
            raise click.UsageError(f"{cmd_name} is not yet available: the commands so far are {have}")
        return super().get_command(ctx, cmd_name)

    def invoke(self, ctx: click.Context) -> Any:
        with _reader_may_leave():
            return super().invoke(ctx)


class _Share(click.FloatRange):
    """Share of clocks; unlike its parent it refuses NaN."""

    def __init__(self) -> None:
        super().__init__(0, 0.99)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        share = super().convert(value, param, ctx)
        if math.isnan(share):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return share


class _Console(Console):
    """Leaves it to `_reader_may_leave` when the reader of its output has gone."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


_HELP = """From a filter specification and calibration data to FPGA hardware that is checked bit for bit.

A specification is a TOML file in physical units: sensor inputs, a calibration polynomial, a filter, the output's
format and the error allowed. Begin with

\b
    sosmith init my.toml        write a commented example
    sosmith design my.toml      see filter, formats, error budget and cost
    sosmith simulate my.toml    run the generated hardware and read the report
"""


@click.group(
    cls=_Commands, help=_HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(sosmith.__version__, prog_name="sosmith")
def cli() -> None:
    """Hold the commands."""


_SPEC = click.argument("spec", type=click.Path(path_type=Path))
_CORE = click.option(
    "--core", type=click.Choice(CORES), help="The part to make.  [default: all that the specification has]"
)
_REALIZATION = click.option(
    "--realization",
    type=click.Choice(["auto", *REALIZATIONS]),
    help="Use this one, whatever the specification says.",
)
_WIDTHS_OF = click.option(
    "--widths-of",
    type=click.Choice(ERROR_FEEDBACK),
    help="Keep the word lengths chosen for this realization, to compare structures at equal width.",
)
_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")
_BOARD = click.option(
    "--board",
    metavar="BOARD",
    help=f"What it is meant for: an automatic choice of the architecture heeds its multipliers. {', '.join(BOARDS)}.",
)
_SEED = click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of noise and handshakes."
)
_SECONDS = click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="Length of a scenario, in seconds of its own time.",
)


def _output_option(text: str) -> Callable[[Any], Any]:
    return click.option("-o", "--output", type=click.Path(path_type=Path), help=text)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path), default=Path("flange_wear.toml"))
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def init(file: Path, force: bool) -> None:
    """Write a commented example specification to FILE (flange_wear.toml if none is given)."""
    if file.exists() and not force:
        raise SpecificationError(f"{file}: the file must not exist yet; use --force to overwrite it")
    write_files(file.parent, {file.name: example()})
    _note(f"wrote {file}; next: sosmith design {file}")


@cli.command()
@_SPEC
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@_JSON
def design(
    spec: Path, core: str | None, realization: str | None, widths_of: str | None, board: str | None, as_json: bool
) -> None:
    """Show the design of SPEC: order, sections, realization, formats, error budget, cost."""
    target = _board(board)
    with _progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
    if as_json:
        _print_json(manifest(made))
    else:
        _print_design(made)


@cli.command()
@_SPEC
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@_output_option("Folder for the files.  [default: build/<name>]")
def generate(
    spec: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    output: Path | None,
) -> None:
    """Write SystemVerilog, RTLIL, manifest, certificate and a bit-true C model of SPEC.

    The paths of the files go to stdout, one a line. Two runs write the same bytes.
    """
    target = _board(board)
    with _progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
        paths = generate_files(made, output or _default_folder(made), step)
    for path in paths:
        click.echo(path)


@cli.command()
@click.argument("certificate", type=click.Path(path_type=Path))
@_JSON
def verify(certificate: Path, as_json: bool) -> None:
    """Prove CERTIFICATE again: the error bound, and that nothing inside can overflow.

    Reads nothing but that file, which `sosmith generate` writes as <name>.certificate.json, and works by another
    method than the one it was made with. Exits with 1 and the reason if anything claimed is not exactly what follows.
    """
    read = read_certificate(certificate)
    with _progress() as step:
        try:
            verdict = verify_certificate(read, step)
        except RejectedError as error:
            raise RejectedError(f"{certificate}: {error}") from None
    if as_json:
        _print_json(_verdict_json(read, verdict))
    else:
        _print_verdict(read, verdict)


@cli.command("simulate")
@_SPEC
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@click.option(
    "--trace",
    "source",
    metavar="FILE.csv|SCENARIO",
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
@_SECONDS
@_SEED
@_JSON
@_output_option("Folder for the files.  [default: build/<name>]")
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
    netlist_for = _board(gates)
    target = _board(board) or netlist_for
    with _progress() as step:
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


@cli.command("emulate")
@_SPEC
@click.argument("scenario", required=False)
@_CORE
@_SECONDS
@_SEED
@_output_option("CSV file to write.  [default: stdout]")
def emulate_command(
    spec: Path, scenario: str | None, core: str | None, seconds: float | None, seed: int, output: Path | None
) -> None:
    """Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios that fit."""
    with _progress() as step:
        made = design_core(load(spec), core=core, progress=step)
        if scenario is None:
            _list_scenarios(made)
            return
        step(f"emulating {scenario}")
        trace, *_ = traces_for(made, _known_scenario(made, scenario), seed=seed, seconds=seconds)
        if output is not None:
            trace.write_csv(output)
    if output is None:
        click.echo(trace.to_csv(), nl=False)
    else:
        _note(f"wrote {output}: {len(trace)} samples at {float(trace.sample_rate):g} Hz")


@cli.command("compare")
@click.argument("reports", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="REPORT REPORT...")
@_JSON
@_output_option("Write a page with the comparison to this HTML file too.")
def compare_command(reports: tuple[Path, ...], as_json: bool, output: Path | None) -> None:
    """Set accuracy reports side by side; each REPORT is a report.json or the folder that holds it."""
    loaded = [load_report(path) for path in reports]
    if output is not None:
        write_files(output.parent, {output.name: comparison_page(loaded)})
        _note(f"wrote {output}")
    if as_json:
        _print_json(comparison_json(loaded))
        return
    table = _table("Accuracy reports", ["", *map(escape, column_names(loaded))])
    for row in compare_reports(loaded):
        cells = [
            f"[bold green]{escape(cell)}[/]" if k in row.best else escape(cell) for k, cell in enumerate(row.cells)
        ]
        table.add_row(escape(row.title), *cells)
    _Console().print(table)


@cli.command()
@_output_option("Folder for the files.  [default: build/demo]")
@_SEED
def demo(output: Path | None, seed: int) -> None:
    """Walk the whole road on the built-in example: a locomotive's flange wear at 100 Hz.

    Designs the filter, generates the hardware, runs it in the simulator on an emulated wear run, and writes the
    report.
    """
    folder = output or Path("build/demo")
    with _progress() as step:
        step("writing the example specification")
        (spec,) = write_files(folder, {"flange_wear.toml": example()})
        made = design_core(load(spec), progress=step)
        summary, folder = _simulate(
            made, step, None, folder, None, simulator="verilator", seed=seed, idle=0.3, stall=0.3, waves=False
        )
    _print_design(made, brief=True)
    _finish(summary, folder, as_json=False)


def main() -> None:
    """Run the command line and end the process with its exit status."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup has hang-ups ignored, and that stays
            signal.signal(number, _stop)
    try:
        status = cli.main(prog_name="sosmith", standalone_mode=False)
    except SosmithError as error:
        _note(f"error: {error}")
        status = error.exit_status
    except click.ClickException as error:
        error.show()
        status = error.exit_code
    except (KeyboardInterrupt, click.Abort):
        _note("interrupted")
        status = _INTERRUPTED
    except OSError as error:
        _note(f"error: {error.filename or 'the output'} must be readable and writable, not: {error.strerror}")
        status = ToolError.exit_status
        _silence_stdout()
    sys.exit(status)


def _stop(number: int, frame: FrameType | None) -> None:
    """End in good order, so that no simulator stays behind."""
    sys.exit(128 + number)


@contextmanager
def _reader_may_leave() -> Iterator[None]:
    """Take it for no error if the reader of our output, such as ``head``, leaves before its end."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        _silence_stdout()


def _silence_stdout() -> None:
    """Let what is still in the buffer go nowhere: flushing it at exit would fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _simulate(
    made: CoreDesign,
    step: _Step,
    source: str | None,
    output: Path | None,
    seconds: float | None,
    **options: Any,
) -> tuple[dict[str, Any], Path]:
    folder = output or _default_folder(made)
    chosen = source or default_scenario(made)
    step(f"trace {chosen}")
    traces = traces_for(made, chosen, seed=options["seed"], seconds=seconds)
    evidence = simulate(made, traces, folder, progress=step, **options)
    step("writing the report")
    return write_report(evidence, folder), folder


def _finish(summary: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    with _reader_may_leave():
        if as_json:
            _print_json(summary)
        else:
            _print_summary(summary)
    _note(f"report: {(folder / 'report.html').resolve().as_uri()}")
    if not summary["passed"]:
        sys.exit(1)


def _default_folder(made: CoreDesign) -> Path:
    return Path("build") / made.spec.name


def _board(name: str | None) -> Board | None:
    return None if name is None else find_board(name)


def _known_scenario(made: CoreDesign, name: str) -> str:
    if name not in SCENARIOS:
        fitting = ", ".join(_fitting(made))
        raise SpecificationError(f"the scenario must be one of {fitting}, not {name}")
    return name


def _fitting(made: CoreDesign) -> list[str]:
    kind = bench_of(made).kind
    return [name for name, scenario in SCENARIOS.items() if kind in scenario.kinds]


def _list_scenarios(made: CoreDesign) -> None:
    bench = bench_of(made)
    table = _table(f"Scenarios for {made.spec.name}", ["name", "seconds", "what it is"])
    for name in _fitting(made):
        table.add_row(name, f"{SCENARIOS[name].default_seconds(bench):.4g}", SCENARIOS[name].description)
    _Console().print(table)


class _Step:
    """Shows one step after another on stderr; called with a name, and with what is done of how much."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)
        self._name = ""

    def __call__(self, name: str, done: int = 0, total: int = 0) -> None:
        if name != self._name:
            self._finish()
            self._name = name
            self._task = self._progress.add_task(name, total=None)
        if total:
            self._progress.update(self._task, completed=done, total=total)

    def _finish(self) -> None:
        if self._name:
            self._progress.update(self._task, total=1, completed=1)
        else:
            self._progress.remove_task(self._task)

    def close(self) -> None:
        self._finish()


@contextmanager
def _progress() -> Iterator[_Step]:
    columns = (
        SpinnerColumn(finished_text="[green]✓[/]"),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        step = _Step(progress)
        yield step
        step.close()


def _note(text: str) -> None:
    click.echo(f"sosmith: {text}", err=True)


def _print_json(tree: Any) -> None:
    click.echo(json.dumps(tree, indent=2, ensure_ascii=False, allow_nan=False))


def _table(title: str, columns: list[str]) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", show_header=any(columns))
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def _print_design(made: CoreDesign, *, brief: bool = False) -> None:
    console = _Console()
    quantized, datapath = made.quantized, made.datapath
    unit = escape(f" {datapath.output.unit}") if datapath.output.unit else ""
    lsb = float(datapath.output.lsb)
    overview = _table(f"{made.spec.name}: {made.core}", ["", ""])
    if quantized.filter is not None:
        overview.add_row("filter", quantized.filter.describe)
        aliasing = quantized.filter.aliasing
        if aliasing is not None:
            deviation, dc = 100 * aliasing.max_deviation, 100 * aliasing.dc_error
            overview.add_row("aliasing", f"at most {deviation:.3g} % of the gain, {dc:.3g} % at zero frequency")
    if made.fit is not None:
        m, n = made.fit.orders
        overview.add_row(
            "calibration",
            f"fitted: orders {m} in voltage, {n} in temperature, adjusted r {made.fit.adjusted_r:.4f}",
        )
    elif quantized.polynomial is not None:
        m, n = quantized.polynomial.orders
        overview.add_row("calibration", f"given: orders {m} in voltage, {n} in temperature")
    for subject, reason in made.reasons.items():
        overview.add_row(subject, reason)
    overview.add_row("output", f"{datapath.output.bits} bits, one LSB = {lsb:.6g}{unit}")
    for name, value in _hardware_rows(made.architecture):
        overview.add_row(name, value)
    if made.spec.channels > 1:
        overview.add_row("channels", f"{made.spec.channels:,}, each at {float(made.spec.sample_rate):,.6g} Hz")
    console.print(overview)
    _print_budget(console, quantized.budget, datapath.output.lsb, datapath.output.unit, made.spec.max_error)
    if brief:
        return
    sections = _table("Sections", ["section", "coefficients", "input", "states", "output"])
    for entry in (entry for section in quantized.sections for entry in section_entries(section)):
        coefficients = "\n".join(f"{c['name']} = {c['integer']} * 2^-{c['frac']}" for c in entry["coefficients"])
        states = "\n".join(f"{name} {form}" for name, form in entry["states"].items())
        sections.add_row(entry["name"], coefficients, entry["input"], states, entry["output"])
    if quantized.sections:
        console.print(sections)
        _print_limit_cycles(console, made)
    _print_schedule(console, made.architecture.program)


def _hardware_rows(architecture: Architecture) -> list[tuple[str, str]]:
    """Say what the hardware has, before synthesis."""
    program, cost = architecture.program, cost_of(architecture.datapath)
    latency = ("latency", f"{architecture.latency_cycles:,} clocks")
    if program is None:
        sizes = f"{cost.adder_bits}, {cost.register_bits}"
        return [latency, ("multipliers", cost.multiplier_sizes), ("adder bits, state and register bits", sizes)]
    word = program.digit_bits + 1
    multiplier = "none, shifts and additions" if architecture.name == "serial" else f"1 of {word} x {word}"
    memory = f"{program.words:,} words of {word} bits a channel, {program.states:,} of them states"
    accumulator = f"{program.accumulator_bits} bits"
    return [
        latency,
        ("multipliers", multiplier),
        ("accumulator", accumulator),
        ("memory", memory),
    ]


def _print_schedule(console: Console, program: Program | None) -> None:
    if program is None:
        return
    table = _table(
        f"Schedule: {len(program.instructions)} instructions for each sample of each channel",
        ["from", "clocks", "value", "words"],
    )
    places = {place.name: f"{place.address}..{place.address + place.digits - 1}" for place in program.places}
    for name, start, count in program.schedule:
        table.add_row(str(start), str(count), escape(name), places.get(name, ""))
    console.print(table)


def _print_limit_cycles(console: Console, made: CoreDesign) -> None:
    table = _table(
        "Limit cycles: what a section's own rounding can sustain, in output LSB",
        ["section", "without input", "dead band", "Lyapunov weights"],
    )
    for name, graph in (pair for section in made.quantized.sections for pair in recursions(section).items()):
        found = limit_cycles(graph)
        largest = "none, proven" if found.none else f"up to {float(found.largest):.4g}"
        weights = ", ".join(f"{float(weight):.4g}" for weight in found.lyapunov or ())
        table.add_row(name, largest, f"{float(found.dead_band):.4g}", weights or "none exist")
    console.print(table)


def _print_budget(console: Console, parts: dict[str, Fraction], lsb: Fraction, unit: str, max_error: Fraction) -> None:
    budget = _table(
        "Error budget, proven for all inputs in range", ["part", escape(unit) or "full scale 1", "output LSB"]
    )
    bound = sum(parts.values(), Fraction(0))
    for part, value in [*parts.items(), ("[bold]sum[/]", bound)]:
        budget.add_row(part, f"{float(value * lsb):.3g}", f"{float(value):.4f}")
    budget.add_row("allowed", f"{float(max_error):.3g}", f"{float(max_error / lsb):.4f}")
    console.print(budget)


def _verdict_json(certificate: Certificate, verdict: Verdict) -> dict[str, Any]:
    lsb = certificate.output.lsb
    return {
        "name": certificate.name,
        "proven": True,
        "error_bound": float(verdict.bound * lsb),
        "error_parts": {part: float(value * lsb) for part, value in verdict.budget.items()},
        "error_unit": certificate.output.unit,
        "max_error": float(certificate.max_error),
        "nodes": verdict.nodes,
        "ranges_from_peak_gains": verdict.ranges,
    }


def _print_verdict(certificate: Certificate, verdict: Verdict) -> None:
    console = _Console()
    ranges = f"{verdict.nodes} nodes within their ranges, {verdict.ranges} by peak gains: nothing inside overflows"
    _print_budget(console, verdict.budget, certificate.output.lsb, certificate.output.unit, certificate.max_error)
    console.print(f"[bold green]proven[/]: {escape(certificate.name)}, {ranges}")


def _print_summary(summary: dict[str, Any]) -> None:
    unit = escape(f" {summary['error']['unit']}".rstrip())
    verdict = "[bold green]passed[/]" if summary["passed"] else "[bold red]fell short[/]"
    table = _table(f"{summary['name']}: {verdict}", ["", ""])
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
    _Console().print(table)


if __name__ == "__main__":
    main()
