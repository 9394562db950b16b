"""Evidence of runs that were not made, and the pages that tell of them."""

from __future__ import annotations

from dataclasses import fields, replace
from fractions import Fraction
from html.parser import HTMLParser
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import signal
from tests.gen.designs import example_design

from sosmith.gen.filter.response import FilterFacts
from sosmith.gen.output.core_facts import (
    CoefficientFacts,
    CoreFacts,
    LimitCycleFacts,
    NodeFormat,
    SectionFacts,
    core_facts,
)
from sosmith.gen.report.evidence import Alternative, Evidence
from sosmith.gen.report.page import render_page
from sosmith.gen.report.report import summarise
from sosmith.gen.report.run import Run
from sosmith.model.port import Port

Array = npt.NDArray[np.float64]


LSB = 16 / 2**16


OUTPUT = Port(name="clearance", bits=16, signed=False, lsb=Fraction(1, 4096), zero=Fraction(0), unit="mm")


F7 = signal.butter(7, 0.2587803, fs=100, output="sos")


def rounded(sos: Array, frac: int) -> Array:
    """Sections with a1, a2 rounded to `frac` fractional bits, and their DC gains kept."""
    result = sos.copy()
    result[:, 4:] = np.round(sos[:, 4:] * 2.0**frac) / 2.0**frac
    change = (result[:, 3:].sum(axis=1)) / (sos[:, 3:].sum(axis=1))
    result[:, :3] *= change[:, None]
    return result


def facts(**changes: Any) -> FilterFacts:
    known: dict[str, Any] = {
        "sample_rate": 100.0,
        "ideal_sos": F7,
        "quantized_sos": rounded(F7, 30),
        "cutoff": (0.2587803,),
    }
    return FilterFacts(**(known | changes))


def core(**changes: Any) -> CoreFacts:
    """Facts about a flange-wear instrument."""
    design = example_design("flange_wear_bench.toml", core="calibration")
    known: dict[str, Any] = {
        "core": "instrument",
        "description": "Wear of a wheel flange.",
        "output": OUTPUT,
        "error_bound": 0.0002,
        "error_parts": {"output": LSB / 2, "coefficients": 0.00002},
        "max_error": 0.00025,
        "realization": "df1_ef2",
        "architecture": "parallel",
        "reasons": {},
        "formats": (NodeFormat(stage="section0", node="v", format="Q7.14", low=-22.5, high=22.5, unit="mm"),),
        "sections": (
            SectionFacts(
                name="section 0",
                coefficients=(CoefficientFacts(name="a1", integer=-66026473, frac=26, value=-0.98387),),
            ),
        ),
        "limit_cycles": (
            LimitCycleFacts(section="section 0", largest=0.00003, dead_band=0.0, none=False, lyapunov=None),
            LimitCycleFacts(
                section="section 1",
                largest=0.00003,
                dead_band=0.000061,
                none=True,
                lyapunov=(Fraction(1), Fraction(1, 3)),
            ),
        ),
        "filter": facts(),
    }
    plain = core_facts(design)
    interface = replace(plain.interface, name=changes.pop("name", "flange_wear"), latency_cycles=23)
    return replace(plain, interface=interface, **(known | changes))


def run_with(**changes: Any) -> Run:
    """Make samples of a flange-wear instrument that is bit exact, or `wrong` at so many samples from 1,500 on."""
    generator = np.random.default_rng(11)
    time = np.arange(3000) / 100
    truth = 2 + 0.2 * time
    unfiltered = truth + 0.3 * np.sin(2 * np.pi * 1.2 * time) + 0.1 * generator.standard_normal(len(time))
    golden = signal.sosfilt(F7, unfiltered)
    wrong = changes.pop("wrong", 0)
    known: dict[str, Any] = {
        "scenario": "wear_ramp",
        "time": time,
        "truth": truth,
        "reading": time > 10,
        "unfiltered": unfiltered,
        "golden": golden,
        "hardware": np.round(golden / LSB) * LSB,
        "cycles": 9007,
    } | changes
    hardware = known["hardware"]
    channels = hardware.shape[1] if hardware.ndim == 2 else 1
    differs = np.zeros((len(hardware), channels), dtype=bool)
    differs[1500 : 1500 + wrong] = True
    codes = np.zeros((len(hardware), channels, 1), dtype=np.int64)
    arrays = {"codes": codes, "received": np.rint(hardware / LSB).astype(np.int64), "differs": differs}
    return Run(**_named(arrays | known))


_NAMES = {"time": "instants", "hardware": "values", "unfiltered": "before"}
"""Attributes of a run by the properties that show them."""


def _named(changes: dict[str, Any]) -> dict[str, Any]:
    return {_NAMES.get(name, name): value for name, value in changes.items()}


def evidence(**changes: Any) -> Evidence:
    """One run of a flange-wear instrument that passes; changes go to the facts or the run that hold them."""
    known: dict[str, Any] = {
        "simulator": "verilator",
        "seed": 7,
        "tools": {"Verilator": "5.048", "cocotb": "2.1.0"},
        "wall_seconds": 1.5,
        "cycles_per_second": 6005.0,
        "alternatives": (Alternative(name="df1", max_abs=0.4, rms=0.1),),
    }
    of_run = {each.name for each in fields(Run)} | {"wrong", *_NAMES}
    own = {each.name for each in fields(Evidence)}
    parts: dict[str, dict[str, Any]] = {"run": {}, "own": {}, "core": {}}
    for name, value in changes.items():
        parts["run" if name in of_run else "own" if name in own else "core"][name] = value
    return Evidence(**({"facts": core(**parts["core"]), "run": run_with(**parts["run"])} | known | parts["own"]))


def changed(made: Evidence, **changes: Any) -> Evidence:
    """Return the same with other samples."""
    return replace(made, run=replace(made.run, **_named(changes)))


def plain(**changes: Any) -> Evidence:
    """Core without a filter, a truth, or anything else that may be missing."""
    bare: dict[str, Any] = {
        "description": "",
        "truth": None,
        "reading": None,
        "unfiltered": None,
        "filter": None,
        "formats": (),
        "sections": (),
        "limit_cycles": (),
        "alternatives": (),
        "error_parts": {},
        "output": replace(OUTPUT, unit=""),
    }
    return evidence(**(bare | changes))


def bandpass() -> Evidence:
    sos = signal.butter(4, (8, 12), btype="bandpass", fs=100, output="sos")
    return evidence(
        filter=facts(
            kind="bandpass",
            ideal_sos=sos,
            quantized_sos=sos,
            cutoff=(8.0, 12.0),
            passband_edge=(9.0, 11.0),
            passband_loss=1.0,
        )
    )


class Page(HTMLParser):
    """Collects tags and attributes, and checks that elements are closed in order."""

    VOID = ("meta", "path", "circle", "use", "rect", "br", "stop")

    def __init__(self, content: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.words: list[str] = []
        self.feed(content)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def page_of(run: Evidence) -> str:
    """Page of `run`."""
    return render_page(run, summarise(run))


def words_of(run: Evidence) -> str:
    """Words of the page of `run`, with plain blanks."""
    return " ".join(" ".join(Page(page_of(run)).words).replace("\u00a0", " ").split())
