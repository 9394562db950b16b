"""Names that options take, and checks of them that need no design: boards, cores, realizations, traces, file formats.

Loads quickly: what a check needs is imported when it is called.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path

from sosmith.gen.calibration.acceptance import REQUIRED_R
from sosmith.gen.estimate.silicon.libraries import LIBRARIES
from sosmith.gen.fpga.boards import BOARDS, BUILDABLE, MODELLED, PROJECTS, SYNTHESIZED
from sosmith.gen.fpga.boards import find_board as _find_board
from sosmith.gen.picture import format_of as picture_format
from sosmith.gen.specification.choices import CORES, ERROR_FEEDBACK, REALIZATIONS
from sosmith.gen.specification.verilog_names import identifier_from
from sosmith.instrument.calibration.acceptance import DEFAULT_RANGES
from sosmith.instrument.calibration.acceptance import METHODS as FIT_METHODS
from sosmith.instrument.scenarios.summaries import SUMMARIES, check_scenario, fitting, is_scenario_file
from sosmith.instrument.spectrum.settings import COVERAGE, DETRENDS, PASSBAND_LOSS, TOLERANCE, WINDOWS
from sosmith.instrument.vehicle.choices import LEVELS, MODELS, TRACK_NAMES
from sosmith.instrument.wear.record_columns import CLEARANCES, TIMES
from sosmith.model.suggestion import did_you_mean
from sosmith.model.traces.suffixes import is_trace_file

__all__ = [
    "BOARDS",
    "BUILDABLE",
    "CLEARANCES",
    "CORES",
    "COVERAGE",
    "DEFAULT_RANGES",
    "DETRENDS",
    "ERROR_FEEDBACK",
    "FIT_METHODS",
    "LEVELS",
    "LIBRARIES",
    "MODELLED",
    "MODELS",
    "PASSBAND_LOSS",
    "PROJECTS",
    "REALIZATIONS",
    "REQUIRED_R",
    "SCENARIOS",
    "SIMULATORS",
    "SYNTHESIZED",
    "TIMES",
    "TOLERANCE",
    "TRACK_NAMES",
    "WINDOWS",
    "board_named",
    "check_date",
    "check_library",
    "check_scenario",
    "check_simulator",
    "check_vectors",
    "check_vlnv",
    "did_you_mean",
    "fitting",
    "identifier_from",
    "is_scenario_file",
    "is_trace_file",
    "picture_format",
]

SIMULATORS = ("verilator", "icarus", "cxxrtl")
"""Names of the simulators."""

SCENARIOS = {name: summary.description for name, summary in SUMMARIES.items()}
"""Descriptions of the built-in traces, by their names; `fitting` names those for a kind of core."""


def board_named(name: str, among: Sequence[str] = tuple(BOARDS)) -> str:
    """Return the name of a board if it is one of these.

    Raises
    ------
    SpecificationError
        If it is not.
    """
    return _find_board(name, among).name


def check_simulator(name: str, *, gates: bool = False) -> None:
    """Refuse a simulator that does not exist, or that cannot simulate `gates`, with a SpecificationError."""
    from sosmith.sim.simulators import check_name

    check_name(name, netlist=gates)


def check_vectors(path: str | PathLike[str]) -> None:
    """Refuse a file for vectors whose suffix is of no known format, with a SpecificationError."""
    from sosmith.gen.output.vectors import check_format

    check_format(Path(fspath(path)))


def check_date(text: str) -> None:
    """Refuse what is no date of the form ``YYYY-MM-DD``, with a SpecificationError."""
    from sosmith.instrument.calibration.store.measurement_files import parse_date

    parse_date(text)


def check_library(name: str) -> None:
    """Refuse standard cells that are not installed, with a ToolError that says how to install them."""
    LIBRARIES[name].check_installed()


def check_vlnv(text: str) -> None:
    """Refuse what is no name of the form vendor:library:name:version, with a SpecificationError."""
    from sosmith.gen.output.packages.vlnv import Vlnv

    Vlnv.read(text)
