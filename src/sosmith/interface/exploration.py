"""Many designs of one specification, all combinations or a search among them: the front of accuracy against cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.gen.chain.reading import is_chain
from sosmith.gen.facts.table import Table, View
from sosmith.gen.fpga.boards import SYNTHESIZED, find_board
from sosmith.gen.quantity import number, quantity
from sosmith.gen.specification.exact_values import exact
from sosmith.interface.certificate import Progress
from sosmith.interface.chain.specification import ChainSpecification, specification_in
from sosmith.interface.specification import Specification
from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.text_files import to_json, write_contents, write_files

if TYPE_CHECKING:
    from sosmith.sim.exploration.parameters import Values
    from sosmith.sim.exploration.run import Outcome


@dataclass(frozen=True)
class Exploration(View):
    """Designs with their figures, as returned by `explore`."""

    outcome: Outcome = field(repr=False)
    """The same in the form of the inner packages."""

    folder: Path
    """Folder of ``exploration.html``, ``exploration.json``, ``points.csv``, and of what a later run goes on from."""

    @property
    def points(self) -> list[dict[str, Any]]:
        """Every combination in the order of the grid or the search: `changes`, and `refused` or the design's figures.

        The figures are `error` (`bound` is proven, `max_abs` and `rms` are measured on the bit-true model), `sqnr_db`,
        `cost` (`value` and `unit`, and what it is made of), `cycles_per_sample` (0.25 with four samples a
        clock), `samples_per_clock`, `latency_cycles`, `realization`, `architecture`, `passed` and `shortfalls`.
        """
        return list(self.outcome.points)

    @property
    def front(self) -> list[dict[str, Any]]:
        """Points that pass and that no other one beats in both error bound and cost, by rising cost.

        Costs are compared among designs with as many samples a clock, and before synthesis within one architecture
        only.
        """
        return self.outcome.front

    def as_dict(self) -> dict[str, Any]:
        """Return `name`, `parameters`, `search`, `samples`, `trace`, `board`, `front` and `points`, in JSON types."""
        return self.outcome.as_dict()

    def page(self) -> str:
        """Return the front and all designs as a self-contained HTML page."""
        from sosmith.sim.exploration.page import exploration_page

        return exploration_page(self.outcome)

    def to_parquet(self, path: str | PathLike[str]) -> Path:
        """Write what ``points.csv`` holds as a Parquet file, with types, for data frames.

        Parameters
        ----------
        path : path
            File to write; an existing one is replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ToolError
            If pyarrow is missing, which the extra ``parquet`` brings.
        """
        from io import BytesIO

        csv, parquet = _arrow()
        rows = csv.read_csv(BytesIO(self.outcome.table().encode()))
        content = BytesIO()
        parquet.write_table(rows, content)
        place = Path(fspath(path))
        write_contents(place.parent, {place.name: content.getvalue()})
        return place

    def tables(self) -> list[Table]:
        """Return the front, a table for each kind of cost."""
        return [self._table(unit) for unit in dict.fromkeys(point["cost"]["unit"] for point in self.front)]

    def _table(self, unit: str) -> Table:
        chosen = {"hardware.realization", "hardware.architecture"}
        keys = [key for key in self.outcome.parameters if key not in chosen]
        rows: list[Sequence[str]] = [
            (
                point["realization"],
                point["architecture"],
                *(_worded(point["changes"][key]) for key in keys),
                quantity(point["error"]["bound"], point["error"]["unit"]),
                f"{point['cost']['value']:,.0f}",
                number(point["cycles_per_sample"]),
            )
            for point in self.front
            if point["cost"]["unit"] == unit
        ]
        named = [key.removeprefix("stage.") if key.startswith("stage.") else key.rpartition(".")[2] for key in keys]
        head = ("realization", "architecture", *named, "bound", "cost", "clocks")
        return Table(f"{self.outcome.name}: the front, cost in {unit}", rows, head)

    @property
    def sentences(self) -> list[str]:
        """How many designs there are behind the front, and whether they do the same job."""
        designs = [point for point in self.points if point["refused"] is None]
        passed, front = sum(bool(point["passed"]) for point in designs), len(self.front)
        jobs = len({point["reference_sha256"] for point in designs})
        different = (
            f"The designs do {jobs:,} different jobs (other filters, inputs, ranges or channels): each bound is "
            "against its own exact calculation."
        )
        return [
            *[different] * (jobs > 1),
            f"{_counted(len(self.points), 'combination')}: {_counted(len(designs), 'design')}, of which {passed:,} "
            f"{'passes' if passed == 1 else 'pass'} and {front:,} {'is' if front == 1 else 'are'} on the front",
        ]

    def __repr__(self) -> str:
        return f"<sosmith.Exploration {self.outcome.name}: {len(self.points)} points, {len(self.front)} on the front>"


def explore(
    specification: Specification | ChainSpecification | str | PathLike[str] | Mapping[str, Any],
    parameters: Mapping[str, Sequence[Any]] | None = None,
    *,
    search: int | None = None,
    folder: str | PathLike[str] | None = None,
    core: str | None = None,
    board: str | None = None,
    samples: int = 20_000,
    trace: str | PathLike[str] | None = None,
    seed: int = 1,
    simulate: bool = False,
    simulator: str = "verilator",
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Progress = lambda step, done, total: None,
) -> Exploration:
    """Design every combination of some values, or search, and find the Pareto front of proven error against cost.

    Every design is proven and run bit-true. Results are kept in `folder` as they come: after an interruption, the same
    call goes on from there. The result does not depend on how many processes or workers took part.

    Parameters
    ----------
    specification : Specification, ChainSpecification, path or mapping
        The specification of a core or of a chain of stages; a path or a mapping is loaded first.
    parameters : mapping of str to sequence
        Keys of the specification with dots, such as "hardware.realization" or "stage.NAME.order", and the values of
        each; for a search also a range as text, such as "0.1..1.6". By default all realizations, parallel and folded,
        at one, two and four times the allowed error; of a chain, only these errors.
    search : int
        Number of designs to make; which ones, an optimizer decides by the results so far (TPE of the package
        optuna). By default all combinations are made.
    folder : path
        Folder of the results, ``build/<name>-exploration`` by default.
    core : str
        The part to design, "instrument", "filter" or "calibration"; by default everything in the specification. A chain
        has none.
    board : str
        Name of a board: the cost is counted after synthesis for its FPGA, which takes seconds for each design, once.
        By default it is estimated for the parallel architecture, and the length of the program for the others.
    samples : int
        Length of the trace for each channel; of a file, as many of its first samples.
    trace : str or path
        Name of a built-in trace, or a CSV, WAV or scenario file; by default that of `Design.simulate`.
    seed : int
        Seed of its noise.
    simulate : bool
        Whether to co-simulate the designs of the front, each with a report.
    simulator : str
        "verilator", "icarus" or "cxxrtl".
    jobs : int
        Number of processes; by default one for each processor.
    scheduler : str
        Address of a Dask scheduler, such as "tcp://127.0.0.1:8786", whose workers do the designs instead.

    Raises
    ------
    SpecificationError
        If a key or value does not exist, or the folder cannot be written or is in use.
    ToolError
        If a tool is missing or fails, a process dies, or the scheduler does not answer.

    Examples
    --------
    >>> import sosmith, tempfile
    >>> spec = sosmith.Specification.from_sos([[0.25, 0.5, 0.25, 1.0, -0.5, 0.25]], 1000, input_bits=8)
    >>> sweep = {"hardware.architecture": ["parallel"], "output.max_error": [0.006, 0.03], "output.bits": [8, 10]}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     exploration = sosmith.explore(spec, sweep, folder=folder, samples=500, jobs=1)
    >>> exploration
    <sosmith.Exploration sos_filter: 4 points, ... on the front>
    """
    from sosmith.instrument.scenarios.traces import ChosenTraces
    from sosmith.instrument.uncertainty.instrument_budget import budget_in_json
    from sosmith.sim.exploration.confirmation import confirmed
    from sosmith.sim.exploration.grid import common_part
    from sosmith.sim.exploration.parameters import default_parameters
    from sosmith.sim.exploration.processes import in_processes, processors
    from sosmith.sim.exploration.run import explore as run

    for name, count in (("samples", samples), ("jobs", jobs), ("search", search)):
        if count is not None and count < 1:
            raise SpecificationError(f"{name} must be at least 1, not {count}")
    if jobs is not None and scheduler is not None:
        raise SpecificationError("jobs must come without a scheduler, whose workers do the designs, not with one")
    asked = _asked(specification).checked
    common = common_part(asked)
    if core is not None and common is not asked:
        raise SpecificationError(f"core must be left out with a chain of stages, not {core}")
    swept = default_parameters(asked) if parameters is None else _plain(parameters)
    place = Path("build") / f"{asked.name}-exploration" if folder is None else Path(fspath(folder))
    traces = ChosenTraces(None if trace is None else fspath(trace))
    traces.check(common, core)
    if scheduler is None:
        runner = partial(in_processes, jobs=jobs or processors())
    else:
        from sosmith.sim.exploration.cluster import on_cluster

        runner = partial(on_cluster, address=scheduler)
    outcome = run(
        asked,
        swept,
        place,
        runner,
        traces=traces,
        search=search,
        core=core,
        samples=samples,
        seed=seed,
        board=None if board is None else find_board(board, SYNTHESIZED).name,
        progress=progress,
    )
    if simulate:
        outcome = confirmed(outcome, place, uncertainty=budget_in_json, simulator=simulator, progress=progress)
    progress("writing the results", 0, 0)
    exploration = Exploration(outcome, place)
    files = {
        "exploration.json": to_json(exploration.as_dict()),
        "points.csv": outcome.table(),
        "exploration.html": exploration.page(),
    }
    write_files(place, files)
    return exploration


def _asked(
    source: Specification | ChainSpecification | str | PathLike[str] | Mapping[str, Any],
) -> Specification | ChainSpecification:
    """Return a specification itself, or load it."""
    if isinstance(source, Specification | ChainSpecification):
        return source
    if isinstance(source, Mapping):
        return ChainSpecification.load(source) if is_chain(source) else Specification.load(source)
    return specification_in(source)


def _arrow() -> tuple[Any, Any]:
    """Return pyarrow's modules for CSV and Parquet."""
    try:
        from pyarrow import csv, parquet
    except ImportError:
        raise ToolError("pyarrow must be installed for Parquet: pip install 'sosmith[parquet]'") from None
    return csv, parquet


def _plain(parameters: Mapping[str, Sequence[Any]]) -> dict[str, Values]:
    """Copy parameters in the types of JSON, ranges apart."""
    from sosmith.sim.exploration.parameters import Span, plain, read_span

    if not parameters or not all(isinstance(values, Span) or len(values) for values in parameters.values()):
        raise SpecificationError("parameters must have a key and a value, not none")
    read: dict[str, Values] = {}
    for key, values in parameters.items():
        span = values if isinstance(values, Span) else read_span(values) if isinstance(values, str) else None
        if span is None and isinstance(values, str):
            raise SpecificationError(f"{key} must be a list of values, or a range such as 1..8, not {values}")
        read[key] = span or plain(key, [exact(value) for value in values])
    return read


def read_parameter(text: str) -> tuple[str, Any]:
    """Read the values of a key as `sosmith explore` takes them, such as ``output.bits=12,14`` or ``filter.order=3..8``.

    Raises
    ------
    SpecificationError
        If the text is not of that form.
    """
    from sosmith.sim.exploration.parameters import read_parameter

    return read_parameter(text)


def _counted(number: int, thing: str) -> str:
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def _worded(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
