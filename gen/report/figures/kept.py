"""The figures of a report, kept for the next report of the same run: to draw them takes most of a report's time.

They are found by a digest of everything that a report shows except for how fast it was: of the design, of every sample
that went in and came out, and of the sources that draw. The run itself is never taken from there.
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import asdict, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.realizations.kept_files import digest_of_sources, folder_in_cache, keep, read_kept
from sosmith.gen.report.behaviour import Behaviour
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.figures.figure import Figure, Figures, Realized

LIMIT = 64
"""Files that are kept, each of about a megabyte; beyond, the older half of them goes."""

_SOURCES = ("gen", "hdl/plan", "model")
"""What decides on the figures, from the folder that holds the rooms."""

_OF_SPEED = ("wall_seconds", "cycles_per_second")


def figures_for(shown: Evidence, measured: Behaviour, *, sound: bool) -> Figures:
    """Return the figures of a report, drawn for it or kept; parameters as of `report_figures.figures_of`."""
    folder = cache_folder()
    key = None if folder is None else key_of(shown)
    if folder is None or key is None:
        return _drawn(shown, measured, sound=sound)
    place = folder / f"{key}.json"
    tree = read_kept(place)
    if tree is not None:
        return figures_of_tree(tree[0])
    figures = _drawn(shown, measured, sound=sound)
    keep(place, tree_of_figures(figures), LIMIT)
    return figures


def cache_folder() -> Path | None:
    return folder_in_cache("figures")


def _drawn(shown: Evidence, measured: Behaviour, *, sound: bool) -> Figures:
    from sosmith.gen.report.figures.report_figures import figures_of  # noqa: PLC0415 - with matplotlib, slow to load

    return figures_of(shown, measured, sound=sound)


class _Sink:
    """Takes what is written into a digest."""

    def __init__(self) -> None:
        self.digest = hashlib.sha256()

    def write(self, data: Any) -> int:
        self.digest.update(data)
        return len(data)


class _Pickler(pickle.Pickler):
    """Writes digests in place of arrays, which may have millions of samples."""

    def persistent_id(self, item: Any) -> Any:
        return _digest(item) if isinstance(item, np.ndarray) and not item.dtype.hasobject else None


def _digest(array: npt.NDArray[Any] | None) -> tuple[str, tuple[int, ...], str] | None:
    if array is None:
        return None
    return array.dtype.str, array.shape, hashlib.sha256(np.ascontiguousarray(array).data).hexdigest()


def key_of(shown: Evidence) -> str | None:
    """Return a digest of what a report shows; None if a part of it has no bytes of its own."""
    run = shown.run
    columns = {each.name: getattr(run, each.name) for each in fields(run)}
    columns["values"] = _digest(run.hardware)  # made where it is asked for: one after the other, for their memory
    columns["before"] = _digest(run.unfiltered)
    parts = {each.name: getattr(shown, each.name) for each in fields(shown) if each.name not in (*_OF_SPEED, "run")}
    sink = _Sink()
    sink.write(digest_of_sources(_SOURCES, np.__version__, version("matplotlib")).encode())
    try:
        _Pickler(sink, protocol=5).dump((columns, parts))
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    return sink.digest.hexdigest()


def tree_of_figures(made: Figures) -> dict[str, Any]:
    """Return figures as `figures_of_tree` takes them."""
    figures = {name: None if figure is None else asdict(figure) for name, figure in made.figures.items()}
    return {"figures": figures, "realized": [asdict(each) for each in made.realized]}


def figures_of_tree(tree: dict[str, Any]) -> Figures:
    """Return the figures that `tree_of_figures` had."""
    figures = {name: None if each is None else _figure(each) for name, each in tree["figures"].items()}
    return Figures(figures, [Realized(**each) for each in tree["realized"]])


def _figure(tree: dict[str, Any]) -> Figure:
    return Figure(**tree | {"legend": [tuple(key) for key in tree["legend"]]})
