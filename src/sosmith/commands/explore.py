"""The command `explore`: many designs of one specification, and the front of accuracy against cost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sosmith.commands.chain import refuse
from sosmith.commands.options import CORE, SEED, SPEC, OneOf, completed_by, print_tables
from sosmith.interface.choices import SIMULATORS, SYNTHESIZED, board_named
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import folder_option
from sosmith.terminal import JSON_OPTION, note, print_json, reader_may_leave, show_progress


@click.command("explore")
@SPEC
@click.option(
    "-p",
    "parameters",
    multiple=True,
    metavar="KEY=V1,V2...",
    help="Values of a key of the specification, such as hardware.realization=df1,delta or stage.NAME.order=3,4, or "
    "for --search a range, such as filter.cutoff=0.1..1.6; several make a grid.  [default: all realizations, parallel "
    "and folded, at 1, 2 and 4 times the allowed error; of a chain of stages, these errors]",
)
@click.option(
    "--search",
    type=click.IntRange(min=1),
    metavar="N",
    help="Make N designs that an optimizer chooses by the results so far.  [default: all combinations]",
)
@CORE
@click.option(
    "--board",
    metavar="BOARD",
    callback=lambda ctx, parameter, name: None if name is None else board_named(name, SYNTHESIZED),
    shell_complete=completed_by(SYNTHESIZED),
    help="Count the cost after synthesis for the FPGA of this board, which takes seconds for each design: "
    f"{', '.join(SYNTHESIZED)}.  [default: an estimate]",
)
@click.option(
    "--samples",
    type=click.IntRange(min=1),
    default=20_000,
    show_default=True,
    help="Samples to run each design on, for each channel.",
)
@click.option(
    "--trace",
    metavar="FILE.csv|wav|toml|SCENARIO",
    help="Stimulus of the inputs; of a file, the first samples.  [default: that of `sosmith simulate`]",
)
@click.option("--simulate", is_flag=True, help="Co-simulate the designs of the front, each with a report.")
@click.option(
    "--simulator",
    type=OneOf(SIMULATORS),
    default="verilator",
    show_default=True,
    help="Simulator for --simulate.",
)
@click.option("--parquet", is_flag=True, help="Write points.parquet too, for data frames; takes the extra parquet.")
@click.option("--jobs", type=click.IntRange(min=1), help="Number of processes.  [default: one for each processor]")
@click.option("--scheduler", metavar="ADDRESS", help="Have the workers of this Dask scheduler do the designs.")
@SEED
@JSON_OPTION
@folder_option("Folder for the results.  [default: build/<name>-exploration]")
def explore_command(
    spec: Path,
    parameters: tuple[str, ...],
    search: int | None,
    core: str | None,
    board: str | None,
    samples: int,
    trace: str | None,
    simulate: bool,
    simulator: str,
    parquet: bool,
    jobs: int | None,
    scheduler: str | None,
    seed: int,
    as_json: bool,
    output: Path | None,
) -> None:
    """Design every combination of values, or search, and show the Pareto front of proven error against cost.

    Every design is proven and run bit-true. Results are kept as they come: interrupted, the same command goes on from
    there. Writes exploration.html, exploration.json and points.csv; exits with 1 if no design passes.

    \b
        sosmith explore my.toml
        sosmith explore my.toml -p hardware.realization=df1,df1_ef2,delta -p output.bits=12,14,16
        sosmith explore my.toml -p filter.order=3..8 -p output.max_error=1e-4..1e-2 --search 200
        sosmith explore my_chain.toml -p stage.cic.order=3,4,5 -p output.max_error=1e-4,2e-4
        sosmith explore my.toml --scheduler tcp://10.0.0.1:8786
    """
    from sosmith.interface.chain.specification import ChainSpecification, specification_in

    asked = specification_in(spec)
    if isinstance(asked, ChainSpecification):
        refuse(core=core)
    folder = output or Path("build") / f"{asked.name}-exploration"
    try:
        with show_progress(remaining=True) as step:
            from sosmith.interface.exploration import explore, read_parameter

            read: list[tuple[str, Any]] = [read_parameter(text) for text in parameters]
            twice = [key for k, (key, _) in enumerate(read) if key in dict(read[:k])]
            if twice:
                raise SpecificationError(f"a parameter must be given once, not twice as {twice[0]}")
            exploration = explore(
                asked,
                dict(read) or None,
                search=search,
                folder=folder,
                core=core,
                board=board,
                samples=samples,
                trace=trace,
                seed=seed,
                simulate=simulate,
                simulator=simulator,
                jobs=jobs,
                scheduler=scheduler,
                progress=step,
            )
    except KeyboardInterrupt:
        if folder.exists():  # said after the bars, which would be drawn over it
            note(f"what is done is kept in {folder}; the same command goes on from there")
        raise
    if parquet:
        exploration.to_parquet(exploration.folder / "points.parquet")
    with reader_may_leave():
        if as_json:
            print_json(exploration.as_dict())
        else:
            print_tables(exploration.tables())
            for sentence in exploration.sentences:
                click.echo(sentence)
    note(f"page: {(exploration.folder / 'exploration.html').resolve().as_uri()}")
    if not exploration.front:
        raise SystemExit(1)
