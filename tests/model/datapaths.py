"""Datapaths for the tests: sections quantized from scipy designs, and polynomials, without `sosmith.gen`."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from scipy import signal

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.graph import Range
from sosmith.model.dataflow.structure import Stage
from sosmith.model.port import Port
from sosmith.model.sections.direct_form import DirectForm1, Product
from sosmith.model.sections.output import OutputStage

INPUT = Port.from_range("x", 16, Fraction(-1), Fraction(1), signed=True)
OUTPUT = Port.from_range("y", 16, Fraction(-1), Fraction(1), signed=True)


def sections_of(sos: np.ndarray, *, guard: int = 5, bits: int = 22, feedback: int = 2) -> list[DirectForm1]:
    """Low-pass sections with unity gain at zero frequency, with ranges far wider than they need."""
    result: list[DirectForm1] = []
    x = Range(0, INPUT.lowest, INPUT.highest)
    for index, (*_, a1, a2) in enumerate(sos):
        first = a2 == 0
        big1, big2 = (1 + a1, 0.0) if first else (2 + a1, 1 + a1 + a2)
        if first:
            products: tuple[Product, ...] = (Product("A1", *_q(big1, bits), (1, 1, 0), (-2, 0), 1),)
        else:
            products = (
                Product("A1", *_q(big1, bits), (0, 0, 0), (-1, 1)),
                Product("A2", *_q(big2, bits + 4), (1, 2, 1), (0, -4), 2),
            )
        kinds: Sequence[tuple[int, int]] = [(0, 0), (-1, 0), (-1, 0) if first else (-2, 1)]
        made = DirectForm1(
            name=f"section{index}",
            products=products,
            integer_part=(-1, 0) if first else (-2, 1),
            feedback=kinds[feedback],
            x=x,
            y_frac=guard,
            v_range=(0, 0),
        )
        limit = 1 << (18 + made.total_frac)
        result.append(replace(made, v_range=(-limit, limit - 1)))
        x = Range(guard, -(1 << (18 + guard)), (1 << (18 + guard)) - 1)
    return result


def _q(value: float, frac: int) -> tuple[int, int]:
    return round(value * 2**frac), frac


def cascade(sos: np.ndarray, **options: int) -> Datapath:
    """Make a plain low-pass filter as a datapath."""
    sections = sections_of(sos, **options)
    last = sections[-1].graph.nodes[sections[-1].graph.outputs[0]]
    stages: tuple[Stage, ...] = (
        *sections,
        OutputStage(
            offset=0,
            offset_frac=0,
            x=last.range,
            low=OUTPUT.lowest,
            high=OUTPUT.highest,
        ),
    )
    return Datapath(name="lowpass", inputs=(INPUT,), output=OUTPUT, stages=stages)


def butterworth(order: int, cutoff: float) -> np.ndarray:
    """Sections of a Butterworth low-pass; `cutoff` over the sample rate. First-order numerators are not used."""
    return signal.butter(order, cutoff, fs=1.0, output="sos")
