"""What a decimated design must stand, whatever is before its filter: the other method's proof, and simulation."""

from collections.abc import Callable
from pathlib import Path

from tests.gen.word_lengths.decimated import read, tree_of

from sosmith.gen.core import CoreDesign
from sosmith.model.traces.trace import Trace
from sosmith.sim.simulation import simulate
from sosmith.verify.specified.stated_specification import check_specification
from sosmith.verify.verification import verify


def check_proof_and_hardware(
    made: CoreDesign, samples_of: Callable[[CoreDesign, int], Trace], number: int, folder: Path
) -> None:
    """Check that the verifier proves what the specification asks for, and that no result of the hardware differs.

    `samples_of` makes the trace of one channel, whose length depends on the `number` of the design.
    """
    spec, datapath = made.spec, made.datapath
    assert datapath.decimator is not None
    certificate = read(tree_of(made))
    verdict = verify(certificate)
    assert verdict.bound * datapath.output.lsb <= spec.max_error
    check_specification(certificate, spec.text, verdict.margin)
    count = 60 * datapath.decimator.factor + number % 7
    trace = samples_of(made, count)
    evidence = simulate(made, [trace.delayed(k) for k in range(spec.channels)], folder, seed=number)
    assert evidence.run.mismatches == 0
    assert evidence.run.samples == datapath.results(count) * spec.channels
