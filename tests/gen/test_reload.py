"""Sets for hardware that exists: proven anew, loadable, and refused where they are not."""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES, example_design

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.design import Filter, design
from sosmith.gen.quantize import with_constants
from sosmith.gen.realizations import REALIZATIONS
from sosmith.gen.reload import OtherSet, other_set, parallel_bank, room_of
from sosmith.gen.specification import load
from sosmith.model.constants import constants, unpacked
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.program import Program
from sosmith.model.swapping import compute_swapping

EXACT = [name for name in REALIZATIONS if name != "state_space"]  # that one rounds its coefficients together


@cache
def hardware_in(architecture: str, example: str = "audio_lowpass.toml", *, clock: int = 100_000_000) -> CoreDesign:
    """Design a core that can be loaded anew."""
    spec = load(EXAMPLES / example)
    hardware = replace(
        spec.hardware, architecture=architecture, clock=Fraction(clock), realization="df1_ef2", reload=True
    )
    return design_core(replace(spec, hardware=hardware))


def moved(hardware: CoreDesign, ratio: str) -> Filter:
    """Design the hardware's filter with another cutoff."""
    wanted = hardware.spec.filter
    assert wanted.cutoff is not None
    cutoff = tuple(value * Fraction(ratio) for value in wanted.cutoff)
    return design(replace(wanted, cutoff=cutoff), float(hardware.spec.sample_rate))


@pytest.mark.parametrize("realization", EXACT)
@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_the_same_constants_make_the_same_design(example: str, realization: str) -> None:
    made = example_design(example, realization=realization).quantized
    again = with_constants(made, made.filter, made.polynomial)
    assert [stage.graph for stage in again.datapath.stages] == [stage.graph for stage in made.datapath.stages]
    assert again.budget == made.budget


@pytest.mark.parametrize("ratio", ["0.5", "0.95", "1.3", "2"])
def test_another_cutoff_is_loadable_within_the_same_bound(ratio: str) -> None:
    hardware = hardware_in("folded")
    made = other_set(hardware, ideal=moved(hardware, ratio))
    assert made.quantized.bound * hardware.spec.output.lsb <= hardware.spec.max_error
    before = hardware.architecture.program
    assert before is not None
    assert made.program is not None
    assert len(made.program.instructions) == len(before.instructions)
    assert (made.program.words, made.program.accumulator_bits) == (before.words, before.accumulator_bits)


def stimulus(hardware: CoreDesign, samples: int) -> np.ndarray:
    """Noise over all codes."""
    rng = np.random.default_rng(3)
    ports = hardware.datapath.inputs
    return np.stack([rng.integers(port.lowest, port.highest + 1, samples) for port in ports], axis=1)


def interpreted(hardware: CoreDesign, programs: list[tuple[int, Program]], codes: np.ndarray) -> list[int]:
    """Run programs one after the other on the same memory, each from its sample on."""
    graph, output = hardware.datapath.stages[0].graph, hardware.datapath.output
    fracs = [graph.nodes[i].frac for i in graph.inputs]
    words = programs[0][1].reset()
    results = []
    for number, sample in enumerate(codes.tolist()):
        running = [program for start, program in programs if start <= number][-1]
        results.append(min(max(running.step(sample, words, fracs).code, output.lowest), output.highest))
    return results


def sets_of(hardware: CoreDesign) -> list[OtherSet]:
    """Two other sets: for the audio filter other cutoffs, for the bench another filter and another polynomial."""
    if hardware.quantized.polynomial is None:
        return [other_set(hardware, ideal=moved(hardware, ratio)) for ratio in ("0.5", "2")]
    scaled = Polynomial(
        tuple(tuple(value * Fraction(9, 10) for value in row) for row in hardware.quantized.polynomial.coefficients)
    )
    return [other_set(hardware, ideal=moved(hardware, "1.3")), other_set(hardware, polynomial=scaled)]


@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_a_program_takes_over_at_any_sample(example: str) -> None:
    """The interpreter with programs exchanged over the same memory computes what the swapping model does."""
    hardware = hardware_in("folded", example)
    first = hardware.architecture.program
    assert first is not None
    one, other = sets_of(hardware)
    assert one.program is not None
    assert other.program is not None
    codes = stimulus(hardware, 160)
    swaps = [(0, first), (37, one.program), (38, other.program), (90, first), (117, one.program)]
    own = with_constants(hardware.quantized, None, None, room=room_of(hardware)).datapath
    datapaths = [(37, one.quantized.datapath), (38, other.quantized.datapath), (90, own), (117, one.quantized.datapath)]
    expected = compute_swapping(own, datapaths, codes)
    assert interpreted(hardware, swaps, codes) == expected
    assert interpreted(hardware, [(0, first), (38, one.program), *swaps[2:]], codes) != expected


def test_a_set_that_breaks_the_bound_is_refused() -> None:
    hardware = hardware_in("folded")
    with pytest.raises(
        ShortfallError,
        match=r"^the set must keep its error within 15.0 × 10⁻⁶, and is proven to [\d.]+ × 10⁻⁶ only: "
        r"nothing is to be loaded$",
    ):
        other_set(hardware, ideal=moved(hardware, "0.95"), max_error=Fraction(15, 1_000_000))


def test_another_structure_is_refused() -> None:
    hardware = hardware_in("folded")
    higher = design(replace(hardware.spec.filter, order=hardware.spec.filter.order + 2), 48000.0)
    with pytest.raises(ShortfallError, match=r"^the filter's sections must have the coefficients \[.*\], not \[.*\]$"):
        other_set(hardware, ideal=higher)
    bench = hardware_in("folded", "flange_wear_bench.toml")
    assert bench.quantized.polynomial is not None
    steeper = Polynomial((*bench.quantized.polynomial.coefficients, (Fraction(1, 1000),)))
    with pytest.raises(ShortfallError, match=r"^the calibration must have at most \[.*\] coefficients .*, not \[.*\]$"):
        other_set(bench, polynomial=steeper)


def test_a_program_that_has_no_room_is_refused() -> None:
    spec = hardware_in("folded").spec
    tight = design_core(replace(spec, hardware=replace(spec.hardware, reload=False)))
    with pytest.raises(
        ShortfallError,
        match=r"^the set must fit the hardware: (to take over, bits of the accumulator must be at most \d+|"
        r"a program must have at most \d+ instructions), not \d+$",
    ):
        other_set(tight, ideal=moved(tight, "1.1"))


def test_the_parallel_bank_holds_the_constants() -> None:
    hardware = hardware_in("parallel")
    made = other_set(hardware, ideal=moved(hardware, "0.95"))
    words = parallel_bank(hardware, made)
    loadable = constants(hardware.datapath)
    values = dict(zip([constant.name for constant in loadable], unpacked(words, loadable), strict=True))
    expected = {
        f"{section.name}.product_{name}": integer
        for section in made.quantized.sections
        for name, (integer, _) in section.coefficients.items()
    }
    assert values == expected
    with pytest.raises(ShortfallError, match=r"^the set must fit the hardware: section1.product_A2 must fit 18 bits, "):
        other_set(hardware, ideal=moved(hardware, "2"), max_error=Fraction(1, 1000))


def test_fingerprints_tell_hardware_apart_and_not_constants() -> None:
    hardware = hardware_in("folded")
    found = {hardware_in(name).architecture.fingerprint for name in ("folded", "serial", "parallel")}
    assert len(found) == 3
    parallel = hardware_in("parallel").architecture
    other = other_set(hardware_in("parallel"), ideal=moved(hardware, "0.95")).quantized.datapath
    assert replace(parallel, datapath=other).fingerprint == parallel.fingerprint
