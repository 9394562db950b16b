"""Commands that simulate the hardware, and generate its stimuli: `simulate`, `emulate`, `demo`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.chain import refuse, run_chain
from sosmith.commands.options import (
    BAUD,
    BOARD,
    CORE,
    PORT,
    REALIZATION,
    SECONDS,
    SEED,
    SPEC,
    WIDTHS_OF,
    OneOf,
    completed_by,
    print_tables,
)
from sosmith.interface.choices import (
    MODELLED,
    SCENARIOS,
    SIMULATORS,
    board_named,
    check_date,
    check_scenario,
    check_simulator,
    check_vectors,
    did_you_mean,
    fitting,
    is_scenario_file,
    is_trace_file,
)
from sosmith.interface.files import default_folder, write_file, write_files
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import folder_option, output_option
from sosmith.terminal import JSON_OPTION, Step, note, print_json, reader_may_leave, show_progress

if TYPE_CHECKING:
    from sosmith.interface.design import Design
    from sosmith.interface.report import Report
    from sosmith.interface.specification import Specification


DEMO_SECONDS, LATER_SECONDS = 15, 5
"""About how long the first demo takes beside Verilator's library, and later ones, rounded up: `python -m
benchmarks.start_up` measures both."""


class _Share(click.FloatRange):
    """Fraction of clocks; unlike its parent, refuses NaN."""

    def __init__(self) -> None:
        super().__init__(0, 0.99)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        share = super().convert(value, param, ctx)
        if math.isnan(share):
            self.fail(f"{value} is not in the range {self._describe_range()}.", param, ctx)
        return share


def _empty_cache(ctx: click.Context, param: click.Parameter, wanted: bool) -> None:
    """Empty the cache of compiled simulations, and end."""
    if not wanted or ctx.resilient_parsing:
        return
    from sosmith.interface.simulating import empty_cache

    removed = empty_cache()
    if removed is None:
        note("there is no cache folder that can be written")
    else:
        note(f"removed {removed[0] / 1e6:.1f} MB from {removed[1]}")
    ctx.exit()


@click.command("simulate")
@SPEC
@CORE
@REALIZATION
@WIDTHS_OF
@BOARD
@click.option(
    "--trace",
    "source",
    metavar="FILE.csv|wav|toml|SCENARIO",
    help="Stimulus of the inputs.  [default: wear_ramp; without a calibration sweep, or passband_sweep for sound]",
)
@click.option(
    "--simulator",
    type=OneOf(SIMULATORS),
    default="verilator",
    show_default=True,
    help="Simulator to use; cxxrtl is Yosys's own.",
)
@click.option(
    "--idle",
    type=_Share(),
    default=0.3,
    show_default=True,
    help="Fraction of clocks without an input sample.",
)
@click.option(
    "--stall",
    type=_Share(),
    default=0.3,
    show_default=True,
    help="Fraction of clocks in which the output is stalled.",
)
@click.option(
    "--gates",
    metavar="BOARD",
    shell_complete=completed_by(MODELLED),
    help="Simulate the netlist that Yosys synthesizes for the FPGA of this board instead: "
    f"{', '.join(MODELLED)}. Synthesis takes seconds, and the simulation is slower.",
)
@PORT
@BAUD
@click.option("--waves", is_flag=True, help="Also write a waveform (VCD); the simulation is slower.")
@click.option(
    "--vectors",
    type=click.Path(path_type=Path),
    metavar="FILE.csv|npz|vcd|hex|wav",
    help="Also write the codes of all samples, in and out; .hex gives two files for $readmemh, .wav what "
    "came out, as sound.",
)
@click.option(
    "--empty-cache",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_empty_cache,
    help="Remove the compiled simulations that were kept, and exit.",
)
@SECONDS
@SEED
@click.option(
    "--date",
    metavar="YYYY-MM-DD",
    help="Date of the run, for the report; without it the report has none, and two runs write the same.",
)
@JSON_OPTION
@folder_option("Folder for the files.  [default: build/<name>]")
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
    port: str | None,
    baud: int,
    waves: bool,
    vectors: Path | None,
    seconds: float | None,
    seed: int,
    date: str | None,
    as_json: bool,
    output: Path | None,
) -> None:
    """Simulate the generated hardware of SPEC and report its accuracy.

    The test bench inserts random idle clocks at the input and random back-pressure at the output. Every sample must
    equal that of the integer model; the error is measured against a double-precision golden model. Writes report.json
    and report.html; exits with 1 if the result falls short. `sosmith emulate SPEC` lists the scenarios.

    With --gates, the same test bench simulates the netlist of FPGA cells, with random initial values in the flip-flops,
    and an automatic choice of the architecture is made for that board.

    With --port, a board runs the core instead of a simulator, and the report is the same.

    Compiled simulations are kept for later runs in ~/.cache/sosmith, or in the folder named by XDG_CACHE_HOME, up to
    512 MB, and the figures of the latest reports, for a run that is the same in every sample.

    \b
        sosmith simulate my.toml
        sosmith simulate my.toml --trace worst_case --simulator icarus -o build/worst
        sosmith simulate my.toml --port /dev/ttyUSB1
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in

    check_simulator(simulator, gates=gates is not None)
    if vectors is not None:
        check_vectors(vectors)
    if date is not None:
        check_date(date)
    if port is not None and (gates is not None or waves):
        raise SpecificationError("--port must come without --gates and --waves, which need a simulator")
    netlist_for = None if gates is None else board_named(gates, MODELLED)
    asked = specification_in(spec)
    if isinstance(asked, ChainSpecification):
        refuse(
            core=core, realization=realization, widths_of=widths_of, gates=gates, port=port, vectors=vectors, date=date
        )
        passed = run_chain(
            asked,
            board,
            source,
            as_json=as_json,
            output=output,
            seconds=seconds,
            simulator=simulator,
            seed=seed,
            idle=idle,
            stall=stall,
            waves=waves,
        )
        sys.exit(0 if passed else 1)
    if source is not None and not _is_file(source):
        check_scenario(source, _kind(asked, core))
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(
            asked,
            core=core,
            realization=realization,
            widths_of=widths_of,
            board=board or netlist_for,
            progress=step,
        )
        report = _simulated(
            designed,
            step,
            source,
            folder=output or default_folder(asked.name),
            seconds=seconds,
            simulator=simulator,
            seed=seed,
            idle=idle,
            stall=stall,
            gates=netlist_for,
            port=port,
            baud=baud,
            waves=waves,
            vectors=vectors,
            date=date,
        )
    _finish(report, as_json=as_json)


@click.command("emulate")
@SPEC
@click.argument("scenario", required=False, metavar="[SCENARIO|FILE.toml]")
@CORE
@SECONDS
@click.option(
    "--measurements",
    is_flag=True,
    help="Write the depot measurements of FILE.toml instead, for `sosmith calibrate add`.",
)
@SEED
@output_option("CSV file to write, or WAV file if its name ends so.  [default: stdout]", stdout=True)
def emulate_command(
    spec: Path,
    scenario: str | None,
    core: str | None,
    seconds: float | None,
    measurements: bool,
    seed: int,
    output: Path | None,
) -> None:
    """Write an emulated sensor trace for SPEC as CSV; without SCENARIO, list the scenarios for SPEC.

    With several channels, the column channel says which channel a row belongs to.

    A scenario is the name of a built-in one, or a file that describes days of operation: see examples/scenarios/ and
    docs/sensors.md.

    \b
        sosmith emulate my.toml
        sosmith emulate my.toml wear_ramp -o ramp.csv
    """
    if measurements:
        if seconds is not None:
            raise SpecificationError("--seconds must come with a scenario's name, not with --measurements")
        _write_measurements(spec, scenario, seed, output)
        return
    from sosmith.interface.specification import Specification

    asked = Specification.load(spec)
    kind = _kind(asked, core)
    if scenario is None:
        from sosmith import Table

        rows = [(name, SCENARIOS[name]) for name in fitting(kind)]
        print_tables([Table(f"Scenarios for {asked.name}", rows, ("name", "description"))])
        note("a scenario file can be given instead of a name: sosmith init --list names examples")
        return
    if scenario not in fitting(kind) and not is_scenario_file(scenario):
        known = fitting(kind)
        raise SpecificationError(
            f"the scenario must be one of {', '.join(known)}, or a file whose name ends in .toml, not "
            f"{scenario}{did_you_mean(scenario, known)}"
        )
    with show_progress() as step:
        from sosmith.interface.design import design

        designed = design(asked, core=core, progress=step)
        step(f"emulating {scenario}")
        trace = designed.trace(scenario, seed=seed, seconds=seconds)
        if output is not None:
            trace.write(output)
    if output is None:
        for piece in trace.pieces():
            click.echo(piece, nl=False)
    else:
        channels = f" of each of {asked.channels} channels" if asked.channels > 1 else ""
        note(f"wrote {output}: {len(trace.time)} samples{channels} at {asked.sample_rate:g} Hz")
    for sentence in designed.notes_on(scenario):
        note(f"note: {sentence}")


@click.command()
@folder_option("Folder for the files.  [default: build/demo]")
@SEED
def demo(output: Path | None, seed: int) -> None:
    """Run the complete flow on the built-in example: a locomotive's flange wear at 100 Hz.

    Designs the filter, generates the hardware, simulates it with an emulated wear run as input, and writes the report.

    \b
        sosmith demo -o my_demo
    """
    from sosmith.interface.specification import Specification

    folder = output or Path("build/demo")
    _say_how_long()
    with show_progress() as step:
        step("writing the example specification")
        (spec,) = write_files(folder, {"flange_wear.toml": Specification.example().toml()})
        from sosmith.interface.design import design

        designed = design(Specification.load(spec), progress=step)
        report = _simulated(designed, step, None, folder=folder, seed=seed)
    print_tables(designed.tables())
    _finish(report, as_json=False)


def _say_how_long() -> None:
    """Say how long the demo takes if this is the first simulation, which takes longer."""
    from sosmith.interface.simulating import library_seconds

    longer = library_seconds()
    if longer:
        note(
            f"the first run takes about {DEMO_SECONDS + longer} s, as Verilator's library is compiled, and "
            f"later ones about {LATER_SECONDS} s"
        )


def _simulated(designed: Design, step: Step, source: str | None, **options: Any) -> Report:
    report = designed.simulate(source, progress=step, **options)
    if source is not None:
        for sentence in designed.notes_on(source):
            note(f"note: {sentence}")
    return report


def _finish(report: Report, *, as_json: bool) -> None:
    with reader_may_leave():
        if as_json:
            print_json(report.summary)
        else:
            print_tables([report.table])
    note(f"report: {(report.folder / 'report.html').resolve().as_uri()}")
    if not report.passed:
        sys.exit(1)


def _kind(spec: Specification, core: str | None) -> str:
    """Return the kind of core that a scenario has to fit."""
    return "filter" if spec.checked.calibration is None or core == "filter" else "instrument"


def _is_file(source: str) -> bool:
    """Tell whether a trace comes from a file: by its suffix, or because the file exists."""
    return source not in SCENARIOS and (is_trace_file(source) or is_scenario_file(source) or Path(source).exists())


def _write_measurements(spec: Path, source: str | None, seed: int, output: Path | None) -> None:
    """Write the measurements taken by hand in a scenario's depot, as CSV."""
    if source is None or not is_scenario_file(source):
        raise SpecificationError(f"--measurements must come with a scenario file (TOML), not {source or 'without one'}")
    from sosmith.interface.specification import Specification

    Specification.load(spec)  # so that a mistake in it is found now
    from sosmith.interface.simulating import depot_measurements

    count, text = depot_measurements(source, seed)
    if output is None:
        click.echo(text, nl=False)
        return
    write_file(output, text)
    note(f"wrote {output}: {count} measurements")
