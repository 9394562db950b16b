"""What goes with simulations: their cache, the time of the first one, and measurements of a scenario's depot."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path


def empty_cache() -> tuple[int, Path] | None:
    """Remove the compiled simulations that were kept; return their bytes and the folder, None if there is none."""
    from sosmith.sim.build_cache import BuildCache, cache_folder

    folder = cache_folder()
    return None if folder is None else (BuildCache(folder).clear(), folder)


def library_seconds() -> int:
    """Return about how long the next simulation takes longer, in s, as Verilator's library is not compiled yet."""
    from sosmith.sim.simulator_bench import has_library
    from sosmith.sim.verilated_model import LIBRARY_SECONDS

    return 0 if has_library() else LIBRARY_SECONDS


def depot_measurements(scenario: str | PathLike[str], seed: int = 1) -> tuple[int, str]:
    """Return how many measurements are taken by hand in the depot of a scenario file, and their text as CSV.

    Raises
    ------
    SpecificationError
        If the file is not a scenario, or has no depot.
    """
    from sosmith.instrument.scenarios.depot_measurements import measurements_csv, measurements_of
    from sosmith.instrument.scenarios.file import load_scenario

    rows = measurements_of(load_scenario(Path(fspath(scenario))), seed)
    return len(rows), measurements_csv(rows)
