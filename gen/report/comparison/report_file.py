"""Reads `report.json` files, checked for all that a comparison uses; those of earlier versions may lack facts."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as shortened
from typing import Any

from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import read_json

Report = Mapping[str, Any]

_NUMBER = (int, float)
_OPTIONAL = (int, float, type(None))
_LARGEST_DRAWN = 1e12
_SECTIONS = 100

_REQUIRED: dict[str, tuple[type, ...]] = {
    "name": (str,),
    "realization": (str,),
    "simulator": (str,),
    "passed": (bool,),
    "bit_exact": (bool,),
    "samples": (int,),
    "cycles_per_sample": _OPTIONAL,
    "error.unit": (str,),
    "error.max_abs": _NUMBER,
    "error.max_lsb": _NUMBER,
    "error.rms": _NUMBER,
    "error.bound": _OPTIONAL,
    "sqnr_db": _OPTIONAL,
    "accuracy_percent.unfiltered": _OPTIONAL,
    "accuracy_percent.golden": _OPTIONAL,
    "accuracy_percent.hardware": _OPTIONAL,
}

_KNOWN: dict[str, tuple[type, ...]] = {
    "scenario": (str,),
    "architecture": (str,),
    "seed": (int,),
    "gates": (str, type(None)),
    "latency_cycles": (int,),
    "error.parts": (dict,),
    "delay": (dict, type(None)),
    "delay.seconds": _NUMBER,
    "frequency_response": (dict,),
    "frequency_response.passband_loss_db": _OPTIONAL,
    "frequency_response.stopband_attenuation_db": _OPTIONAL,
    "aliases": (dict, type(None)),
    "aliases.anywhere_db": _OPTIONAL,
    "aliases.passband_db": _OPTIONAL,
    "true_error": (dict, type(None)),
    "true_error.max_abs": _NUMBER,
    "true_error.rms": _NUMBER,
    "sound": (dict, type(None)),
    "sound.error_peak_dbfs": _OPTIONAL,
    "sound.error_rms_dbfs": _OPTIONAL,
    "sound.tone": (dict, type(None)),
    "sound.tone.thd_n_db": _OPTIONAL,
    "cycles_per_second": _OPTIONAL,
    "sosmith_version": (str,),
    "tools": (dict,),
    "provenance": (dict, type(None)),
    "provenance.specification": (dict,),
    "provenance.specification_sha256": (str,),
    "provenance.reference_sha256": (str,),
    "provenance.trace_sha256": (str,),
    "provenance.datapath_sha256": (str,),
    "provenance.cycles_per_sample": _NUMBER,
    "provenance.cost": (dict,),
    "provenance.cost.source": (str,),
    "provenance.cost.board": (str, type(None)),
    "provenance.cost.luts": (int, type(None)),
    "provenance.cost.multiplier_blocks": (int, type(None)),
    "provenance.cost.register_bits": (int, type(None)),
    "provenance.cost.instructions": (int, type(None)),
    "provenance.cost.memory_words": (int, type(None)),
    "curves": (dict,),
    "curves.error": (dict,),
    "curves.spectrum": (dict, type(None)),
    "curves.filter": (dict, type(None)),
}
"""Facts that reports of earlier versions lack: checked where they are present."""


def load_report(path: Path) -> dict[str, Any]:
    """Read a report from its `report.json` or the folder that holds it.

    Raises
    ------
    SpecificationError
        If it cannot be read or is not a report.
    """
    file = path / "report.json" if path.is_dir() else path
    content = read_json(file, what="a report.json, or a folder that holds one,", parse_constant=_refuse_constant)
    if content is None:
        raise SpecificationError(f"{file} must be a report.json of sosmith, not text that is no JSON")
    problem = _problem(content)
    if problem:
        raise SpecificationError(f"{file} must be a report.json of sosmith, not JSON {problem}")
    report: dict[str, Any] = content
    return report


def fact(report: Report, key: str) -> Any:
    """Value of `key`, with dots, in a report; None if the report does not know it."""
    value: Any = report
    for part in key.split("."):
        if not isinstance(value, Mapping) or part not in value:
            return None
        value = value[part]
    return value


def _refuse_constant(name: str) -> float:
    """Refuse NaN and infinity, which Python's reader takes and JSON does not have."""
    raise ValueError(name)


def _problem(content: Any) -> str:
    """Say, to follow "JSON", what keeps `content` from being a report; empty if nothing does."""
    for keys, types in _REQUIRED.items():
        problem = _wrong(content, keys, types, required=True)
        if problem:
            return problem
    for keys, types in _KNOWN.items():
        problem = _wrong(content, keys, types, required=False)
        if problem:
            return problem
    for name in fact(content, "error.parts") or {}:
        problem = _wrong(content["error"]["parts"], name, _NUMBER, required=True)
        if problem or not name.isprintable():
            return f"with {shortened(name)} in error.parts"
    for name, version in (fact(content, "tools") or {}).items():
        if not isinstance(version, str) or not (name + version).isprintable():
            return f"with {shortened(version)} as tools.{shortened(name)}"
    return _wrong_curves(content)


def _wrong(content: Any, keys: str, types: tuple[type, ...], *, required: bool) -> str:
    value = content
    for key in keys.split("."):
        if not isinstance(value, dict) or key not in value:
            return f"without {keys}" if required else ""
        value = value[key]
    # bool is a kind of int in Python, not in JSON
    if not isinstance(value, types) or (isinstance(value, bool) and bool not in types):
        return f"with {shortened(value)} as {keys}"
    # half of a surrogate pair cannot be printed, and a line break would break the table
    if isinstance(value, str) and not value.isprintable():
        return f"with {shortened(value)} as {keys}"
    if isinstance(value, str) and keys.endswith("_sha256") and not re.fullmatch("[0-9a-f]{64}", value):
        return f"with {shortened(value)} as {keys}"
    # no float holds such a number, and 1e999 is read as infinity
    if isinstance(value, _NUMBER) and not abs(value) <= sys.float_info.max:
        return f"with a number out of range as {keys}"
    return ""


def _wrong_curves(content: Any) -> str:
    """Say what is wrong with the curves: lists of numbers that must have one length, and be fit to be drawn."""
    for keys, names in {"curves.error": ("time", "low", "high"), "curves.spectrum": ("frequency", "density")}.items():
        curve = fact(content, keys)
        if curve is None:
            continue
        for name in names:
            if not _drawable(curve.get(name)) or len(curve[name]) != len(curve[names[0]]):
                return f"with {shortened(curve.get(name))} as {keys}.{name}"
    filter_ = fact(content, "curves.filter")
    if filter_ is None:
        return ""
    if not _drawable([filter_.get("sample_rate")]) or filter_["sample_rate"] <= 0:
        return f"with {shortened(filter_.get('sample_rate'))} as curves.filter.sample_rate"
    for name in ("ideal_sos", "quantized_sos"):
        rows = filter_.get(name)
        if not isinstance(rows, list) or not 1 <= len(rows) <= _SECTIONS:
            return f"with {shortened(rows)} as curves.filter.{name}"
        if not all(_drawable(row) and len(row) >= 6 and len(row) % 2 == 0 and len(row) == len(rows[0]) for row in rows):
            return f"with {shortened(rows)} as curves.filter.{name}"
    return ""


def _drawable(values: Any) -> bool:
    return (
        isinstance(values, list)
        and bool(values)
        and all(isinstance(v, _NUMBER) and not isinstance(v, bool) and abs(v) <= _LARGEST_DRAWN for v in values)
    )
