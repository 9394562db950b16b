"""The `sosmith` command: data goes to stdout, progress and messages to stderr.

Exit status: 0 good; 1 the result falls short; 2 bad usage or a bad specification; 3 a tool is missing or
failed; 130 interrupted.
"""

from __future__ import annotations

import math
import signal
import sys
from fractions import Fraction
from pathlib import Path
from types import FrameType
from typing import Any

import click
from rich.console import Console
from rich.markup import escape

import sosmith
from sosmith.commands.calibrate import calibrate
from sosmith.commands.paper import paper
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
from sosmith.gen.reload import Swap, check_swap, own_set, set_for
from sosmith.gen.reload_file import reload_json
from sosmith.gen.report import write_report
from sosmith.gen.specification import Specification, example, load
from sosmith.gen.verification import RejectedError, Verdict
from sosmith.gen.verification import verify as verify_certificate
from sosmith.model.errors import SosmithError, SpecificationError, ToolError
from sosmith.model.program import Program
from sosmith.model.scenarios import SCENARIOS
from sosmith.model.text_files import to_json, write_files
from sosmith.sim.simulation import bench_of, default_scenario, simulate, traces_for
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
    silence_stdout,
)

_LATER = ("build", "explore", "monitor", "board")
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
        with reader_may_leave():
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


@cli.command()
@click.argument("file", type=click.Path(path_type=Path), default=Path("flange_wear.toml"))
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def init(file: Path, force: bool) -> None:
    """Write a commented example specification to FILE (flange_wear.toml if none is given)."""
    if file.exists() and not force:
        raise SpecificationError(f"{file}: the file must not exist yet; use --force to overwrite it")
    write_files(file.parent, {file.name: example()})
    note(f"wrote {file}; next: sosmith design {file}")


@cli.command()
@_SPEC
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@JSON_OPTION
def design(
    spec: Path, core: str | None, realization: str | None, widths_of: str | None, board: str | None, as_json: bool
) -> None:
    """Show the design of SPEC: order, sections, realization, formats, error budget, cost."""
    target = _board(board)
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
    if as_json:
        print_json(manifest(made))
    else:
        _print_design(made)


@cli.command()
@_SPEC
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@output_option("Folder for the files.  [default: build/<name>]")
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
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
        paths = generate_files(made, output or _default_folder(made), step)
    for path in paths:
        click.echo(path)


@cli.command()
@click.argument("certificate", type=click.Path(path_type=Path))
@JSON_OPTION
def verify(certificate: Path, as_json: bool) -> None:
    """Prove CERTIFICATE again: the error bound, and that nothing inside can overflow.

    Reads nothing but that file, which `sosmith generate` writes as <name>.certificate.json, and works by another
    method than the one it was made with. Exits with 1 and the reason if anything claimed is not exactly what follows.
    """
    read = read_certificate(certificate)
    with show_progress() as step:
        try:
            verdict = verify_certificate(read, step)
        except RejectedError as error:
            raise RejectedError(f"{certificate}: {error}") from None
    if as_json:
        print_json(_verdict_json(read, verdict))
    else:
        _print_verdict(read, verdict)


@cli.command("reload")
@_SPEC
@click.argument("other", type=click.Path(path_type=Path))
@_CORE
@_REALIZATION
@_WIDTHS_OF
@_BOARD
@click.option(
    "--active",
    type=click.Path(path_type=Path),
    help="Specification of the set that the core runs when it is loaded.  [default: SPEC]",
)
@click.option(
    "--reset",
    is_flag=True,
    help="The core will be reset between the swap and its next sample: no transient then, and more sets fit.",
)
@click.option(
    "--version",
    type=click.IntRange(0, (1 << 32) - 1),
    default=1,
    show_default=True,
    help="What the register VERSION is to read once the set is active.",
)
@JSON_OPTION
@output_option("JSON file for the register writes.  [default: build/<name>/<stem of OTHER>.reload.json]")
def reload_command(
    spec: Path,
    other: Path,
    core: str | None,
    realization: str | None,
    widths_of: str | None,
    board: str | None,
    active: Path | None,
    reset: bool,
    version: int,
    as_json: bool,
    output: Path | None,
) -> None:
    """Prove a set of constants for a core that runs, and write what loads it.

    SPEC is what the core was generated from, with `reload = true` under [hardware], and with the same options. OTHER is
    a specification with another [calibration], [filter] or max_error, all else as in SPEC; its [hardware] does not
    count.

    The hardware keeps its word lengths, so not every set fits. This proves that the new set keeps its error within
    OTHER's max_error, and that nothing inside can wrap while the filter still remembers the set before. The table says
    after how many samples the bound holds again; no other swap may follow before. Exits with 1 and the reason if the
    set is refused: then do not load it.

    The file's `writes` are pairs of a byte address and a word for the AXI4-Lite port, in order. Before, compare
    `design` with the register DESIGN. docs/registers.md has the registers.
    """
    target = _board(board)
    with show_progress() as step:
        made = design_core(
            load(spec), core=core, realization=realization, widths_of=widths_of, board=target, progress=step
        )
        step("set")
        wanted = load(other)
        new = set_for(made, wanted)
        before = own_set(made) if active is None else set_for(made, load(active))
        step("swap")
        swap = check_swap(made, None if reset else before, new)
    tree = reload_json(made, swap, version)
    path = output or _default_folder(made) / f"{other.stem}.reload.json"
    write_files(path.parent, {path.name: to_json(tree)})
    if as_json:
        print_json(tree)
    else:
        _print_swap(made, wanted, swap, tree)
    note(f"wrote {path}")


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
    netlist_for = _board(gates)
    target = _board(board) or netlist_for
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


@cli.command("emulate")
@_SPEC
@click.argument("scenario", required=False)
@_CORE
@_SECONDS
@_SEED
@output_option("CSV file to write.  [default: stdout]")
def emulate_command(
    spec: Path, scenario: str | None, core: str | None, seconds: float | None, seed: int, output: Path | None
) -> None:
    """Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios that fit."""
    with show_progress() as step:
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
        note(f"wrote {output}: {len(trace)} samples at {float(trace.sample_rate):g} Hz")


@cli.command("compare")
@click.argument("reports", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="REPORT REPORT...")
@JSON_OPTION
@output_option("Write a page with the comparison to this HTML file too.")
def compare_command(reports: tuple[Path, ...], as_json: bool, output: Path | None) -> None:
    """Set accuracy reports side by side; each REPORT is a report.json or the folder that holds it."""
    loaded = [load_report(path) for path in reports]
    if output is not None:
        write_files(output.parent, {output.name: comparison_page(loaded)})
        note(f"wrote {output}")
    if as_json:
        print_json(comparison_json(loaded))
        return
    table = new_table("Accuracy reports", ["", *map(escape, column_names(loaded))])
    for row in compare_reports(loaded):
        cells = [
            f"[bold green]{escape(cell)}[/]" if k in row.best else escape(cell) for k, cell in enumerate(row.cells)
        ]
        table.add_row(escape(row.title), *cells)
    TableConsole().print(table)


cli.add_command(calibrate)
cli.add_command(paper)


@cli.command()
@output_option("Folder for the files.  [default: build/demo]")
@_SEED
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
        note(f"error: {error}")
        status = error.exit_status
    except click.ClickException as error:
        error.show()
        status = error.exit_code
    except (KeyboardInterrupt, click.Abort):
        note("interrupted")
        status = _INTERRUPTED
    except OSError as error:
        note(f"error: {error.filename or 'the output'} must be readable and writable, not: {error.strerror}")
        status = ToolError.exit_status
        silence_stdout()
    sys.exit(status)


def _stop(number: int, frame: FrameType | None) -> None:
    """End in good order, so that no simulator stays behind."""
    sys.exit(128 + number)


def _simulate(
    made: CoreDesign,
    step: Step,
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
    with reader_may_leave():
        if as_json:
            print_json(summary)
        else:
            _print_summary(summary)
    note(f"report: {(folder / 'report.html').resolve().as_uri()}")
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
    table = new_table(f"Scenarios for {made.spec.name}", ["name", "seconds", "what it is"])
    for name in _fitting(made):
        table.add_row(name, f"{SCENARIOS[name].default_seconds(bench):.4g}", SCENARIOS[name].description)
    TableConsole().print(table)


def _print_design(made: CoreDesign, *, brief: bool = False) -> None:
    console = TableConsole()
    quantized, datapath = made.quantized, made.datapath
    unit = escape(f" {datapath.output.unit}") if datapath.output.unit else ""
    lsb = float(datapath.output.lsb)
    overview = new_table(f"{made.spec.name}: {made.core}", ["", ""])
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
    sections = new_table("Sections", ["section", "coefficients", "input", "states", "output"])
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
    table = new_table(
        f"Schedule: {len(program.instructions)} instructions for each sample of each channel",
        ["from", "clocks", "value", "words"],
    )
    places = {place.name: f"{place.address}..{place.address + place.digits - 1}" for place in program.places}
    for name, start, count in program.schedule:
        table.add_row(str(start), str(count), escape(name), places.get(name, ""))
    console.print(table)


def _print_limit_cycles(console: Console, made: CoreDesign) -> None:
    table = new_table(
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
    budget = new_table(
        "Error budget, proven for all inputs in range", ["part", escape(unit) or "full scale 1", "output LSB"]
    )
    bound = sum(parts.values(), Fraction(0))
    for part, value in [*parts.items(), ("[bold]sum[/]", bound)]:
        budget.add_row(part, f"{float(value * lsb):.3g}", f"{float(value):.4f}")
    budget.add_row("allowed", f"{float(max_error):.3g}", f"{float(max_error / lsb):.4f}")
    console.print(budget)


def _print_swap(made: CoreDesign, wanted: Specification, swap: Swap, tree: dict[str, Any]) -> None:
    console = TableConsole()
    output, quantized = made.datapath.output, swap.made.quantized
    unit = escape(f" {output.unit}".rstrip())
    bound, allowed = quantized.bound * output.lsb, wanted.max_error
    table = new_table(f"{made.spec.name}: the set may be loaded", ["", ""])
    if quantized.filter is not None:
        table.add_row("filter", quantized.filter.describe)
    table.add_row("error bound", f"{float(bound):.3g}{unit} of {float(allowed):.3g}{unit} allowed")
    table.add_row("headroom", f"{float(allowed - bound):.3g}{unit}, {float(100 * (1 - bound / allowed)):.1f} %")
    if swap.samples:
        seconds = swap.samples / float(made.spec.sample_rate)
        table.add_row("transient", f"{swap.samples:,} samples, {seconds:.3g} s, until the bound holds")
    else:
        table.add_row("transient", "none, the bound holds from the first sample on")
    table.add_row("states", f"take at most {100 * float(swap.use):.3g} % of what their words hold")
    crc = tree["writes"][-1][1]
    table.add_row("load", f"version {tree['version']}, {tree['words']:,} words, CRC 0x{crc:08X}")
    table.add_row("for the design", f"0x{tree['design']:08X}")
    console.print(table)


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
    console = TableConsole()
    ranges = f"{verdict.nodes} nodes within their ranges, {verdict.ranges} by peak gains: nothing inside overflows"
    _print_budget(console, verdict.budget, certificate.output.lsb, certificate.output.unit, certificate.max_error)
    console.print(f"[bold green]proven[/]: {escape(certificate.name)}, {ranges}")


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


if __name__ == "__main__":
    main()
