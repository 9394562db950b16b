"""Ranges of responses that take turns, as those behind look-ahead, where a rounding is never negative."""

import random
from fractions import Fraction

import pytest
from flint import fmpq, fmpq_poly
from tests.gen.word_lengths.decimated import read, tree_of
from tests.verify.parallel.cores import specified

from sosmith.gen.core import design_core
from sosmith.verify.bounds.driven_responses import Denominator, extremes
from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.graph import RejectedError
from sosmith.verify.verification import verify


def _binary(rng: random.Random) -> fmpq:
    return fmpq(rng.randrange(-256, 257), 256)


def test_rough_limits_hold_for_every_sum() -> None:
    """Whatever drives it: with a range around zero, above it, below it, and a constant."""
    rng, hardly = random.Random(4), Fraction(1, 1 << 60)
    for _ in range(40):
        step = rng.choice([2, 4])
        over = Denominator(fmpq_poly([1, *[0] * (step - 1), _binary(rng) / 2]))
        drives = [
            (fmpq_poly([_binary(rng) for _ in range(3)]), Fraction(low), Fraction(high))
            for low, high in ((-1, 2), (1, 1), (-3, -2), (0, 1))
        ]
        low, high = extremes(over, drives)
        rough_low, rough_high = extremes(over, drives, rough=True)
        assert rough_low - hardly <= low < high <= rough_high + hardly


SLOW = """
name = "f"
sample_rate = 48000.0
channels = 1
input.x = { bits = 24, signed = false, range = [0.0, 1.0] }
[filter]
family = "chebyshev2"
kind = "bandpass"
order = 1
cutoff = [240.0, 624.0]
stopband_loss = 60.0
[output]
bits = 8
signed = false
range = [0.0, 1.0]
unit = ""
max_error = "faithful"
[hardware]
architecture = "parallel"
clock = 300000000.0
pipeline = "look-ahead"
start = "steady"
"""


@pytest.mark.slow
def test_a_slow_band_with_look_ahead() -> None:
    """Its responses take more than two million samples: no sum may have to be followed that far."""
    certificate = read(tree_of(design_core(specified(SLOW))))
    assert verify(certificate).ranges > 0
    widest = max(
        (node for stage in certificate.stages for node in stage.nodes if node.op is Operation.BOUND),
        key=lambda node: node.high,
    )
    tree = certificate.model_dump(mode="json")
    for stage in tree["stages"]:
        for node in stage["nodes"]:
            if (node["op"], node["high"]) == ("bound", widest.high):
                node["high"] //= 2
    with pytest.raises(RejectedError):
        verify(Certificate.model_validate(tree))
