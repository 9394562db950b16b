"""The report of one co-simulation: `report.json` for scripts, `report.html` for people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from sosmith.gen.filter.response import ResponseMeasures, measure_response
from sosmith.gen.output.core_facts import CoreFacts
from sosmith.gen.output.manifest import limit_cycle_entry
from sosmith.gen.quantity import quantity
from sosmith.gen.report.behaviour import aliases_entry, behaviour, behaviour_entry, readings_of
from sosmith.gen.report.curves import error_over_time, error_spectrum, filter_curve
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.headlines import headlines
from sosmith.gen.report.input_ranges import inputs_at_an_end, limited_inputs
from sosmith.gen.report.mask import mask_shortfalls
from sosmith.gen.report.page import render_page
from sosmith.gen.report.provenance import Provenance
from sosmith.gen.report.sound import sound_entry
from sosmith.gen.version import __version__
from sosmith.model.reference.accuracy import ErrorStatistics, accuracy_percent, error_statistics, sqnr_db
from sosmith.model.text_files import to_json, write_files


def _shortfalls(evidence: Evidence, max_abs: float, measures: ResponseMeasures | None) -> list[str]:
    """Reasons why the run did not pass, one sentence each; none if it did."""
    shortfalls = []
    facts, run = evidence.facts, evidence.run
    if run.mismatches:
        where = "" if run.first_mismatch is None else f", first at sample {run.first_mismatch:,}"
        shortfalls.append(
            f"The hardware differs from the integer model at {run.mismatches:,} of {run.samples:,} samples{where}."
        )
    error = quantity(max_abs, facts.unit)
    if max_abs > facts.error_bound:
        shortfalls.append(f"The largest error is {error}, over the limit of {quantity(facts.error_bound, facts.unit)}.")
    if max_abs > facts.max_error:
        asked = quantity(facts.max_error, facts.unit)
        shortfalls.append(f"The largest error is {error}, more than the {asked} that the specification allows.")
    if facts.filter is not None and measures is not None:
        shortfalls += mask_shortfalls(facts.filter, measures)
    return [*shortfalls, *limited_inputs(evidence.input_ranges)]


def _notes(evidence: Evidence) -> list[str]:
    """Say what a reader must know to judge the verdict, one sentence each."""
    notes = []
    facts = evidence.facts
    if evidence.gates is not None and evidence.gates.excess:
        board = evidence.gates.board
        notes.append(f"The netlist takes more than the {board.title} has: {', '.join(evidence.gates.excess)}.")
    if facts.error_bound > facts.max_error:
        notes.append(
            f"The error limit {quantity(facts.error_bound, facts.unit)} is wider than the "
            f"{quantity(facts.max_error, facts.unit)} that the specification allows: other inputs "
            "could exceed the allowance."
        )
    return [*notes, *inputs_at_an_end(evidence.input_ranges)]


def _accuracy(evidence: Evidence) -> dict[str, float | None]:
    """Accuracy of each trace by the paper's equation 7, None where there is no truth to measure against."""
    traces = ("unfiltered", "golden", "hardware")
    truth, reading = evidence.run.truth, readings_of(evidence)
    if truth is None:
        return dict.fromkeys(traces)
    counted = truth if reading is None else truth[reading]
    if not len(counted) or not counted.all():
        return dict.fromkeys(traces)
    accuracy: dict[str, float | None] = {}
    for name in traces:
        values = getattr(evidence.run, name)
        accuracy[name] = None if values is None else accuracy_percent(values, truth, reading)
    return accuracy


def summarise(evidence: Evidence) -> dict[str, Any]:
    """Content of `report.json`.

    Returns
    -------
    dict
        The keys of the contract, and: ``core``, ``scenario``, ``realization``, ``architecture``, ``gates`` (name of
        the board whose netlist ran, None if the SystemVerilog itself did), ``lsb``, ``range``, ``max_error``,
        ``error.{max_lsb,mean,proven,parts}``, ``first_mismatch``, ``latency_cycles``, ``cycles_per_sample`` (of
        this run, waiting included), ``start_up.{samples,seconds,limit}`` (None unless the filter starts from zero;
        ``accuracy_percent`` and ``true_error`` leave these samples out, unless the trace marks its readings),
        ``aliases.{anywhere_db,passband_db}`` (see `sosmith.gen.report.behaviour.aliases_entry`),
        ``uncertainty`` (the budget of a reading in the terms of the GUM, at the point where it is largest; None if
        nothing is known of what the calibration is worth), ``decimation`` (factor, stages, delay, and what folds into
        the pass band; None without a decimator), ``alternatives``, ``limit_cycles``, ``tools``,
        ``sosmith_version``, ``date`` (as given by the user, else None), ``files`` (SHA-256 of each generated file),
        ``true_error.{max_abs,rms,mean,readings}`` (hardware against the true value at the readings),
        ``delay.{seconds,frequency}`` (group delay, and where it is taken), ``settling.{seconds,half_lsb_seconds,
        overshoot_percent}`` (after a step, to 1 %, and to half an LSB over the whole range), ``shortfalls`` (why it did
        not pass), ``notes``, ``inputs`` (the shares of codes ``at_end`` of the range and of values ``limited`` to it),
        ``provenance.{specification,specification_sha256,
        reference_sha256,trace_sha256,datapath_sha256,cycles_per_sample,cost}`` (see
        `sosmith.gen.report.provenance.Provenance`), ``curves.{error,spectrum,filter}`` (see
        `sosmith.gen.report.curves`) and ``facts`` (the headline figures of the page, in groups: ``name``, ``value``,
        ``unit``, ``text``, ``sentence``, and ``share`` of the limit). Lengths are in samples or cycles, errors in
        ``error.unit``. What is unknown or not finite is None.
        ``passed`` is true if hardware and integer model agree bit for bit, the largest error is within
        ``error.bound`` and ``max_error``, no value of the trace was outside its
        input's range, and the quantized filter is stable and meets the specification's mask (see `mask_shortfalls`).
    """
    facts, run = evidence.facts, evidence.run
    statistics = error_statistics(run.error)
    measures = None if facts.filter is None else measure_response(facts.filter)
    shortfalls = _shortfalls(evidence, statistics.max_abs, measures)
    measured = behaviour(evidence)
    summary: dict[str, Any] = {
        "name": facts.name,
        "core": facts.core,
        "scenario": run.scenario,
        "passed": not shortfalls,
        "shortfalls": shortfalls,
        "notes": _notes(evidence),
        "inputs": [each.entry for each in evidence.input_ranges],
        "samples": run.samples,
        "channels": run.channels,
        "cycles": run.cycles,
        "cycles_per_sample": run.cycles / (run.taken or run.samples),
        "latency_cycles": facts.interface.latency_cycles,
        "simulator": evidence.simulator,
        "gates": None if evidence.gates is None else evidence.gates.board.name,
        "seed": evidence.seed,
        "bit_exact": run.mismatches == 0,
        "mismatches": run.mismatches,
        "first_mismatch": run.first_mismatch,
        "error": _error(facts, statistics),
        **behaviour_entry(measured),
        "max_error": facts.max_error,
        "lsb": facts.lsb,
        "range": list(facts.range),
        "sqnr_db": sqnr_db(run.golden, run.error),
        "sound": sound_entry(evidence, statistics),
        "frequency_response": _response_summary(measures),
        "aliases": aliases_entry(facts),
        "decimation": None if facts.lower_rate is None else facts.lower_rate.entries,
        "accuracy_percent": _accuracy(evidence),
        "uncertainty": evidence.uncertainty,
        "start_up": None if facts.settling is None else asdict(facts.settling),
        "alternatives": [
            {"name": other.name, "max_abs": other.max_abs, "rms": other.rms} for other in evidence.alternatives
        ],
        "limit_cycles": [limit_cycle_entry(cycles) for cycles in facts.limit_cycles],
        "realization": evidence.realization,
        "architecture": facts.architecture,
        "cycles_per_second": evidence.cycles_per_second,
        "wall_seconds": evidence.wall_seconds,
        "sosmith_version": __version__,
        "date": evidence.date,
        "files": dict(evidence.files),
        "tools": dict(evidence.tools),
        "provenance": None if evidence.provenance is None else _entry(evidence.provenance),
        "curves": _curves(evidence),
    }
    summary["facts"] = headlines(evidence, summary, measured)
    cleaned: dict[str, Any] = _without_infinities(summary)
    return cleaned


def _error(facts: CoreFacts, statistics: ErrorStatistics) -> dict[str, Any]:
    """Errors in the output's unit, and the largest one in its LSBs too."""
    return {
        "max_abs": statistics.max_abs,
        "max_lsb": statistics.max_abs / facts.lsb,
        "rms": statistics.rms,
        "mean": statistics.mean,
        "bound": facts.error_bound,
        "proven": True,
        "parts": dict(facts.error_parts),
        "unit": facts.unit,
    }


def _curves(evidence: Evidence) -> dict[str, Any]:
    """Curves that pages of comparisons draw."""
    return {
        "error": error_over_time(evidence.run.error, evidence.run.instants),
        "spectrum": error_spectrum(evidence.shown.run.error, evidence.run.instants),
        "filter": filter_curve(evidence.facts.filter),
    }


def _entry(provenance: Provenance) -> dict[str, Any]:
    return {each.name: getattr(provenance, each.name) for each in fields(provenance)}


def _response_summary(measures: ResponseMeasures | None) -> dict[str, float | None]:
    """Measures of the response by name, None for a core without a filter."""
    names = (
        "max_deviation_db_passband",
        "stopband_attenuation_db",
        "passband_loss_db",
        "largest_pole_radius",
    )
    return {name: getattr(measures, name, None) for name in names}


def _without_infinities(value: Any) -> Any:
    """Copy of nested dicts and lists with None in place of what JSON cannot say."""
    if isinstance(value, Mapping):
        return {key: _without_infinities(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_infinities(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_report(evidence: Evidence, directory: Path) -> dict[str, Any]:
    """Write `report.json` and `report.html` into `directory`, created if missing, and return the summary.

    Raises
    ------
    SpecificationError
        If the folder cannot be made or written; both files are then as they were.
    """
    summary = summarise(evidence)
    page = render_page(evidence, summary)
    write_files(directory, {"report.json": to_json(summary), "report.html": page})
    return summary
