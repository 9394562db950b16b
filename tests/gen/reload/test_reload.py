"""Sets for hardware that exists: proven anew, loadable, and refused where they are not."""

import zlib
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.gen.designs import EXAMPLES, zero_design
from tests.gen.reload.swaps import during, moved, worst_input
from tests.model.reload.swapping import compute_swapping
from tests.model.reload.unpacking import unpacked

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import design
from sosmith.gen.realizations.registry import SECTIONS
from sosmith.gen.reload import reload
from sosmith.gen.reload.other_constants import with_constants
from sosmith.gen.reload.register_writes import register_writes, reload_json
from sosmith.gen.reload.reload import ADVICE, OtherSet, check_swap, other_set, own_set, room_of, set_for
from sosmith.gen.specification.specification import load
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.gen.word_lengths.settling import samples_to_settle
from sosmith.hdl.plan.instructions import encoded
from sosmith.model.dataflow.program import Judged, Opcode, Program
from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reload.constants import constants
from sosmith.model.reload.registers import CRC, DATA, VERSION

EXACT = [name for name in SECTIONS if name != "state_space"]  # that one rounds its coefficients together


@cache
def hardware_in(architecture: str, example: str = "audio_lowpass.toml", *, clock: int = 100_000_000) -> CoreDesign:
    """Design a core that can be loaded anew, and starts from zero; `test_start` has those that start steady."""
    spec = load(EXAMPLES / example)
    hardware = replace(
        spec.hardware,
        architecture=architecture,
        clock=Fraction(clock),
        realization="df1_ef2",
        reload=True,
        start="zero",
    )
    return design_core(replace(spec, hardware=hardware))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("realization", EXACT)
@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_the_same_constants_make_the_same_design(example: str, realization: str) -> None:
    made = zero_design(example, realization=realization).quantized
    again = with_constants(made, made.filter, made.polynomial)
    assert [stage.graph for stage in again.datapath.stages] == [stage.graph for stage in made.datapath.stages]
    assert again.budget == made.budget


@pytest.mark.sweep(2)
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


@pytest.mark.sweep(1)
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


@pytest.mark.slow
def test_a_set_that_settles_too_slowly_is_refused() -> None:
    """The hardware counts to three times the length with its own filter, and no further."""
    hardware = hardware_in("parallel")
    counted = hardware.quantized.settling
    assert counted == 3 * samples_to_settle(hardware.datapath)
    slow = moved(hardware, "0.3")
    samples = samples_to_settle(with_constants(hardware.quantized, slow, None).datapath)
    assert samples > counted
    sentence = f"the set must settle within {counted:,} samples, to which the hardware counts, not {samples:,}"
    with pytest.raises(ShortfallError, match=f"^{sentence}$"):
        other_set(hardware, ideal=slow, max_error=100 * hardware.spec.max_error)


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
    with pytest.raises(
        ShortfallError,
        match=r"^the filter's sections must have the coefficients A1 and A1, A2 and A1, A2, not A1 and "
        r"A1, A2 and A1, A2 and A1, A2: what is loaded are values, and the core stays as it is$",
    ):
        other_set(hardware, ideal=higher)
    bench = hardware_in("folded", "flange_wear_bench.toml")
    assert bench.quantized.polynomial is not None
    steeper = Polynomial((*bench.quantized.polynomial.coefficients, (Fraction(1, 1000),)))
    with pytest.raises(ShortfallError, match=r"^the calibration must have at most \[.*\] coefficients .*, not \[.*\]$"):
        other_set(bench, polynomial=steeper)


@pytest.mark.slow
def test_a_program_that_has_no_room_is_refused() -> None:
    spec = hardware_in("folded").spec
    tight = design_core(replace(spec, hardware=replace(spec.hardware, reload=False)))
    with pytest.raises(
        ShortfallError,
        match=r"^the set must fit the hardware: (to take over, bits of the accumulator must be at most \d+|"
        r"a program must have at most \d+ instructions), not \d+$",
    ):
        other_set(tight, ideal=moved(tight, "2"))


def test_the_parallel_bank_holds_the_constants() -> None:
    hardware = hardware_in("parallel")
    made = other_set(hardware, ideal=moved(hardware, "0.95"))
    words = hardware.architecture.bank(made.quantized.datapath, None)
    loadable = constants(hardware.datapath)
    values = dict(zip([constant.name for constant in loadable], unpacked(words, loadable), strict=True))
    expected = {
        f"{section.name}.product_{name}": integer
        for section in made.quantized.sections
        for name, (integer, _) in section.coefficients.items()
    }
    assert values == expected
    with pytest.raises(ShortfallError, match=r"^the set must fit the hardware: section1.product_A2 must fit 20 bits, "):
        other_set(hardware, ideal=moved(hardware, "2"), max_error=Fraction(1, 1000))


def test_fingerprints_tell_hardware_apart_and_not_constants() -> None:
    hardware = hardware_in("folded")
    found = {hardware_in(name).architecture.fingerprint for name in ("folded", "serial", "parallel")}
    assert len(found) == 3
    parallel = hardware_in("parallel").architecture
    other = other_set(hardware_in("parallel"), ideal=moved(hardware, "0.95")).quantized.datapath
    assert replace(parallel, datapath=other).fingerprint == parallel.fingerprint


# Swaps.


@pytest.mark.sweep(1)
@pytest.mark.parametrize("ratio", ["0.8", "1.2"])
@pytest.mark.parametrize("example", ["audio_lowpass.toml", "flange_wear_bench.toml"])
def test_a_cutoff_a_fifth_away_may_be_swapped_to(example: str, ratio: str) -> None:
    hardware = hardware_in("folded", example)
    made = other_set(hardware, ideal=moved(hardware, ratio))
    swap = check_swap(hardware, own_set(hardware), made)
    assert 0 < swap.use < Fraction(1, 10)
    assert 50 < swap.samples < 1000
    assert swap.new_set.quantized is made.quantized
    back = check_swap(hardware, made, own_set(hardware))
    assert back.new_set.program is not None
    assert hardware.architecture.program is not None
    assert len(back.new_set.program.instructions) == len(hardware.architecture.program.instructions)
    if example != "audio_lowpass.toml":  # there, a value needs one digit more while states of the other set are left
        assert back.new_set.program.instructions == hardware.architecture.program.instructions


def test_a_program_takes_over_under_the_worst_input() -> None:
    """The interpreter, which minds the widths of words and accumulator, against the graphs with the swap's ranges."""
    hardware = hardware_in("folded")
    first, own = hardware.architecture.program, own_set(hardware)
    made = other_set(hardware, ideal=moved(hardware, "0.5"))
    swap = check_swap(hardware, own, made)
    assert first is not None
    assert swap.new_set.program is not None
    codes = worst_input(own.quantized, made.quantized, 250, 300)
    expected = compute_swapping(own.quantized.datapath, [(250, during(own.quantized, made.quantized))], codes)
    assert interpreted(hardware, [(0, first), (250, swap.new_set.program)], codes) == expected
    narrow = replace(swap.new_set.program, accumulator_bits=swap.new_set.program.accumulator_bits - 4)
    with pytest.raises(OverflowError):
        interpreted(hardware, [(0, first), (250, narrow)], codes)


def test_a_realization_that_changes_its_coefficients_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    hardware = hardware_in("folded")
    changed = with_constants(hardware.quantized, moved(hardware, "1.2"), None, room=room_of(hardware))
    monkeypatch.setattr(reload, "with_constants", lambda *arguments, **options: changed)
    monkeypatch.setattr(reload, "room_of", lambda hardware: 0)
    with pytest.raises(
        ShortfallError,
        match=r"^the realization must keep its coefficients to be loaded anew, and df1_ef2 does not$",
    ):
        own_set(hardware)


@pytest.mark.slow
def test_a_swap_in_the_parallel_architecture_has_one_bit_of_room() -> None:
    hardware = hardware_in("parallel")
    own, wide = own_set(hardware), 4 * hardware.spec.max_error
    assert check_swap(hardware, own, other_set(hardware, ideal=moved(hardware, "0.85"), max_error=wide)).use < 1
    far = other_set(hardware, ideal=moved(hardware, "0.5"), max_error=wide)
    with pytest.raises(
        ShortfallError,
        match=r"^the swap must fit the hardware: section1\.v1 must stay in -(\d+)\.\.\d+, not -\d+\.\.\d+; " + ADVICE,
    ):
        check_swap(hardware, own, far)
    assert check_swap(hardware, None, far).samples == 0


def test_a_swap_that_overflows_the_accumulator_is_refused() -> None:
    """The same hardware with one bit less than swaps need."""
    hardware = hardware_in("folded")
    made = hardware.architecture.program
    assert made is not None
    tight = replace(hardware, architecture=replace(hardware.architecture))
    tight.architecture.__dict__["program"] = replace(made, accumulator_bits=made.accumulator_bits - 3)
    with pytest.raises(
        ShortfallError,
        match=r"^the swap must fit the hardware: to take over, bits of the accumulator must be at most \d+, not \d+; ",
    ):
        check_swap(tight, own_set(tight), replace(own_set(tight), quantized=far_from(hardware)))


def far_from(hardware: CoreDesign) -> Quantized:
    """Make a set with a cutoff that is much lower, without a look at the hardware."""
    return with_constants(hardware.quantized, moved(hardware, "0.1"), None, finer=2, room=room_of(hardware))


def test_writes_of_a_program() -> None:
    hardware = hardware_in("folded")
    swap = check_swap(hardware, own_set(hardware), other_set(hardware, ideal=moved(hardware, "1.2")))
    version, *data, crc = register_writes(hardware, swap.new_set, 7)
    words, bits = hardware.architecture.bank_size
    made = swap.new_set.program
    assert made is not None
    assert version == (VERSION, 7)
    assert data == [(DATA, encoded(instruction, made)) for instruction in made.instructions]
    assert len(data) == words
    assert all(0 <= word < 1 << bits for _, word in data)
    assert crc == (CRC, zlib.crc32(np.array([7, *(word for _, word in data)], dtype="<u4").tobytes()))
    tree = reload_json(hardware, swap, 7)
    assert tree["writes"][0] == [VERSION.address, 7]
    assert (tree["words"], tree["design"]) == (words, hardware.architecture.fingerprint)
    assert tree["error_bound"] < tree["error_after_transient"] <= float(hardware.spec.max_error)
    with pytest.raises(ValueError, match=r"^version must be in 0\.\.4294967295, not -1$"):
        register_writes(hardware, swap.new_set, -1)


def test_writes_of_the_parallel_architecture() -> None:
    hardware = hardware_in("parallel")
    own = own_set(hardware)
    _, *data, _ = register_writes(hardware, own, 0)
    assert hardware.architecture.bank_size == (len(data), 32)
    loadable = constants(hardware.datapath)
    assert unpacked([word for _, word in data], loadable) == [
        hardware.datapath.stages[c.stage].graph.nodes[c.node].parameter for c in loadable
    ]


# Sets by specification.


def measured(hardware: CoreDesign, path: Path, low: float, high: float) -> None:
    """Write measurements of a sensor close to the example's, for voltages from `low` to `high`."""
    assert hardware.quantized.polynomial is not None
    rows = []
    for voltage in np.linspace(low, high, 8):
        for temperature in (0.0, 20.0, 100.0):
            clearance = 1.16 - 0.0036 * temperature + (0.3672 + 0.0006618 * temperature) * voltage
            rows.append(f"{clearance + 0.058 * voltage**2},{voltage},{temperature}\n")
    path.write_text("clearance_mm,voltage_V,temperature_C\n" + "".join(rows), encoding="utf-8")


def test_a_calibration_brings_its_range_along(tmp_path: Path) -> None:
    hardware = hardware_in("folded", "flange_wear_bench.toml")
    assert hardware.spec.calibration is not None
    measured(hardware, tmp_path / "new.csv", 2, 8)
    calibration = replace(hardware.spec.calibration, coefficients=None, data=tmp_path / "new.csv")
    wanted = replace(hardware.spec, calibration=calibration, max_error=2 * hardware.spec.max_error)
    made = set_for(hardware, wanted)
    assert made.quantized.datapath.calibrated == ((13107, 52429), (0, 51200))
    assert made.program is not None
    judges = [one for one in made.program.instructions if one.opcode is Opcode.JUDGE]
    assert [one.target for one in judges] == [Judged.OUTSIDE] * 3 + [Judged.SETTLING]
    assert check_swap(hardware, own_set(hardware), made).samples > 0


@pytest.mark.slow
def test_the_parallel_architecture_judges_by_its_own_range(tmp_path: Path) -> None:
    hardware = hardware_in("parallel", "flange_wear_bench.toml")
    assert hardware.spec.calibration is not None
    measured(hardware, tmp_path / "new.csv", 2, 8)
    calibration = replace(hardware.spec.calibration, coefficients=None, data=tmp_path / "new.csv")
    wanted = replace(hardware.spec, calibration=calibration, max_error=4 * hardware.spec.max_error)
    with pytest.raises(
        ShortfallError,
        match=r"^the measurements must cover all codes that the hardware's did, 0\.\.65535 and 0\.\.65535, not "
        r"13107\.\.52429 and 0\.\.51200: the parallel architecture goes on to flag samples by those$",
    ):
        set_for(hardware, wanted)


def test_a_specification_that_differs_in_more_is_refused() -> None:
    hardware = hardware_in("folded")
    spec = replace(hardware.spec, path=Path("other.toml"))
    for changed, sentence in (
        ({"sample_rate": Fraction(1)}, f"sample_rate must be as in {hardware.spec.path} for a set to be loaded there"),
        ({"inputs": ()}, f"inputs must be as in {hardware.spec.path} for a set to be loaded there"),
        (
            {"calibration": hardware_in("folded", "flange_wear_bench.toml").spec.calibration},
            f"there must be no [calibration], as in {hardware.spec.path}",
        ),
    ):
        with pytest.raises(SpecificationError) as refusal:
            set_for(hardware, replace(spec, **changed))
        assert str(refusal.value) == f"other.toml: {sentence}"
    fixed = replace(hardware, spec=replace(hardware.spec, hardware=replace(hardware.spec.hardware, reload=False)))
    with pytest.raises(SpecificationError) as refusal:
        set_for(fixed, spec)
    assert str(refusal.value) == f"{fixed.spec.path}: hardware.reload must be true for a set to be loaded, not false"
