"""Filters and formats that tests of word lengths start from."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from sosmith.gen.filter.design import Filter, design
from sosmith.gen.specification.specification import FilterSpec
from sosmith.gen.word_lengths.quantize import quantize
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.port import Port
from sosmith.model.reference.golden import calibrated, filtered

SIGNED = Port.from_range("x", 16, Fraction(-1), Fraction(1), signed=True)


OUT = Port.from_range("y", 16, Fraction(-1), Fraction(1), signed=True)


def butterworth(order: int, cutoff: float, kind: str = "lowpass") -> Filter:
    band = (Fraction(cutoff),) if kind in {"lowpass", "highpass"} else (Fraction(cutoff), Fraction(cutoff * 1.3))
    return design(
        FilterSpec(
            family="butterworth",
            kind=kind,
            method="bilinear",
            order=order,
            cutoff=band,
            passband_edge=None,
            stopband_edge=None,
            passband_loss=None,
            stopband_loss=None,
            sos=None,
        ),
        1.0,
    )


def fir_spec(taps: Sequence[str]) -> FilterSpec:
    nothing = dict.fromkeys(
        ("order", "cutoff", "passband_edge", "stopband_edge", "passband_loss", "stopband_loss", "sos")
    )
    return FilterSpec(family="fir", kind="fir", method="fir", taps=tuple(map(Fraction, taps)), **nothing)  # type: ignore[arg-type]


def plain(
    ideal: Filter, realization: str = "df1_ef2", inputs: Port = SIGNED, output: Port = OUT, *, steady: bool = False
) -> Quantized:
    return quantize(
        name="test",
        inputs=(inputs,),
        output=output,
        max_error=output.lsb,
        ideal=ideal,
        polynomial=None,
        realization=realization,
        steady=steady,
    )


def stimulus(ports: tuple[Port, ...], seed: int, samples: int = 30000) -> np.ndarray:
    """Random codes, then both rails, then a small step: what finds overflow, gain errors and dead bands."""
    rng = np.random.default_rng(seed)
    codes = np.stack([rng.integers(p.lowest, p.highest + 1, samples) for p in ports], axis=1)
    for part, pick in ((1, "highest"), (2, "lowest")):
        codes[samples * part // 4 : samples * (part + 1) // 4] = [getattr(p, pick) for p in ports]
    codes[samples * 3 // 4 :] = [(p.lowest + p.highest) // 2 + 5 for p in ports]
    return codes


def errors(quantized: Quantized, codes: np.ndarray) -> np.ndarray:
    """Integer model minus golden chain, in output LSBs."""
    datapath = quantized.datapath
    before = calibrated(codes, datapath.inputs, quantized.polynomial)
    sos = None if quantized.filter is None else quantized.filter.sos
    golden = filtered(before, sos, datapath.output, steady=quantized.steady)
    return (datapath.output.decode(datapath.compute(codes)) - golden) / float(datapath.output.lsb)
