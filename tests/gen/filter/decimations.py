"""Low-pass filters behind a decimator."""

from fractions import Fraction

from sosmith.gen.filter.decimation import (
    Decimation,
)
from sosmith.gen.specification.specification import FilterSpec


def lowpass(order: int = 7, cutoff: str = "0.2587802", decimate: int | str = "auto", **options: str) -> FilterSpec:
    return FilterSpec(
        **{"family": "butterworth", "kind": "lowpass", "method": "bilinear"} | options,
        order=order,
        cutoff=(Fraction(cutoff),),
        passband_edge=None,
        stopband_edge=None,
        passband_loss=Fraction(1, 2),
        stopband_loss=Fraction(50),
        sos=None,
        decimate=decimate,
    )


RATE = Fraction(100)


def decimation(factor: int = 16, stages: int = 4, edge: str = "0.2587802") -> Decimation:
    return Decimation(factor=factor, stages=stages, sample_rate=RATE, edge=Fraction(edge))
