"""No false flag of wear in thousands of resets and reloads, each followed by a start of every channel, in hardware."""

import random
import tomllib
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
import pytest
from tests.gen.designs import EXAMPLES
from tests.sim.stream.restarts import Outcome, run
from tests.verify.small_specifications import STEADY_INSTRUMENT

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.design import design
from sosmith.gen.proof.settling import SETTLED
from sosmith.gen.reload.reload import OtherSet, other_set
from sosmith.gen.specification.specification import from_tree, load
from sosmith.gen.specification.wear_limits import WearSpec
from sosmith.model.arrays import Codes
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.status import Flag
from sosmith.model.errors import ShortfallError
from sosmith.model.polynomial import Polynomial
from sosmith.model.reference.golden import calibrated

LIMITS = 5.4, 5.8
"""Clearances in mm of the warning and of the limit."""

TEXT = STEADY_INSTRUMENT + f"wear = {{ initial = 4.0, warning = {LIMITS[0] - 4:.1f}, limit = {LIMITS[1] - 4:.1f} }}\n"
FLAGS = Flag.WEAR_WARNING, Flag.WEAR_CRITICAL
SETS = 4
RESETS = 50
"""Constant samples of all channels; each reset has the next ones."""


@dataclass(frozen=True, eq=False)
class Case:
    """A core, sets that fit it, and samples that are clear of the limits with every one of them."""

    made: CoreDesign
    sets: list[OtherSet]
    codes: Codes

    def values(self, load: int) -> npt.NDArray[np.float64]:
        """Clearances with a set, or with the core's own for -1."""
        made = self.made.quantized if load < 0 else self.sets[load].quantized
        rows = self.codes.reshape(-1, self.codes.shape[-1])
        return calibrated(rows, made.datapath.inputs, made.polynomial).reshape(self.codes.shape[:-1])


def core(architecture: str, start: str, order: int = 1, cutoff: int = 20, **changes: Any) -> CoreDesign:
    """Design the small instrument with a filter, and changes of the hardware or of `channels`."""
    spec = from_tree(tomllib.loads(TEXT, parse_float=Decimal), Path("small.toml"))
    assert spec.filter is not None
    wanted, channels = replace(spec.filter, order=order, cutoff=(Fraction(cutoff),)), changes.pop("channels", 1)
    hardware = replace(spec.hardware, architecture=architecture, start=start, reload=True, clock=Fraction(10**9))
    return design_core(replace(spec, filter=wanted, channels=channels, hardware=replace(hardware, **changes)))


def drawn(architecture: str, start: str, chance: random.Random) -> CoreDesign:
    """Design a core with a random filter, realization, number of channels and protection."""
    folds = ["df1", "df1_ef1", "df1_ef2", "df2t"]
    return core(
        architecture,
        start,
        order=chance.randint(1, 3),
        cutoff=chance.randint(12, 30),
        channels=chance.choice((1, 1, 2, 3)),
        realization=chance.choice([*folds, "normal"] if architecture == "parallel" else folds),
        protect=chance.choice(("none", "none", "detect", "correct")),
    )


def case(made: CoreDesign, chance: random.Random) -> Case:
    """Draw other calibrations for a core, every other one with another filter, and samples."""
    polynomial, wanted = made.quantized.polynomial, made.spec.filter
    assert polynomial is not None
    assert wanted is not None
    assert wanted.cutoff is not None
    sets: list[OtherSet] = []
    for turn in range(20 * SETS):
        ratio, moved = (Fraction(chance.randint(850, 1150), 1000) for _ in range(2))
        scaled = Polynomial(tuple(tuple(ratio * c for c in row) for row in polynomial.coefficients))
        other = replace(wanted, cutoff=(wanted.cutoff[0] * moved,))
        ideal = design(other, float(made.spec.sample_rate)) if turn % 2 else None
        try:
            sets.append(other_set(made, ideal=ideal, polynomial=scaled, max_error=4 * made.spec.max_error))
        except ShortfallError:
            continue
        if len(sets) == SETS:
            break
    assert len(sets) == SETS
    rng = np.random.default_rng(chance.getrandbits(32))
    pool = np.stack([rng.integers(port.lowest, port.highest + 1, 3000) for port in made.datapath.inputs], axis=1)
    clear = np.ones(len(pool), dtype=bool)
    for one in (made.quantized, *(other.quantized for other in sets)):
        values = calibrated(pool, one.datapath.inputs, one.polynomial)
        bound = float((one.bound + SETTLED) * one.datapath.output.lsb)
        clear &= np.all([np.abs(values - limit) > bound for limit in LIMITS], axis=0)
    channels = made.architecture.channels
    return Case(made, sets, pool[clear][: RESETS * channels].reshape(RESETS, channels, -1))


def check_beats(found: Case, outcome: Outcome) -> None:
    """Each result is that of the integer model, from reset on, with the set and the samples after its start."""
    datapaths = [found.made.datapath, *(other.quantized.datapath for other in found.sets)]
    output, channels = found.made.datapath.output, found.made.architecture.channels
    for number, datapath in enumerate(datapaths, start=-1):
        here = outcome.loads[outcome.start] == number
        length = int(outcome.index[here].max()) + 1
        codes = np.broadcast_to(
            found.codes.reshape(1, RESETS * channels, -1), (length, RESETS * channels, found.codes.shape[-1])
        )
        column = outcome.resets[outcome.start[here]] % RESETS * channels + outcome.channel[here]
        results = datapath.compute(codes)[outcome.index[here], column] % (1 << 8 * output.bytes)
        assert np.array_equal(outcome.data[here], results)
        assert np.array_equal(outcome.status[here], datapath.compute_status(codes)[outcome.index[here], column])


def false_flags(found: Case, outcome: Outcome) -> int:
    """Count the results with a false flag of wear, and those without a true one after the stated settling time."""
    settled = found.made.quantized.settling
    wrong = 0
    for number in range(-1, len(found.sets)):
        here = outcome.loads[outcome.start] == number
        values = found.values(number)[outcome.resets[outcome.start[here]] % RESETS, outcome.channel[here]]
        for flag, limit in zip(FLAGS, LIMITS, strict=True):
            raised = (outcome.status[here] >> flag & 1).astype(bool)
            wrong += int(np.count_nonzero(raised & (values < limit)))  # false at any time
            wrong += int(np.count_nonzero(~raised & (values > limit) & (outcome.index[here] >= settled)))
    return wrong


@pytest.mark.slow
@pytest.mark.parametrize("start", ["steady", pytest.param("zero", marks=pytest.mark.slow)])
def test_a_few_restarts(start: str, tmp_path: Path) -> None:
    found = case(core("parallel", start), random.Random(1))
    outcome = run(tmp_path, found.made, found.sets, 40, found.codes, 1)
    check_beats(found, outcome)
    assert false_flags(found, outcome) == 0
    assert outcome.reloads > 10


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_a_swap_that_keeps_the_states_raises_false_flags(architecture: str, tmp_path: Path) -> None:
    """Break the core: what is loaded takes over at once, and the filter answers the step of the calibration."""
    found = case(core(architecture, "steady", order=2), random.Random(1))
    with patch.object(Datapath, "restarts", new=False):
        outcome = run(tmp_path, found.made, found.sets, 200, found.codes, 1)
    assert false_flags(found, outcome) > 0


STARTS, DRAWS = 10_000, 4
"""Resets and reloads, at least, of each architecture and kind of start, in so many cores."""


@pytest.mark.slow
@pytest.mark.parametrize("start", ["steady", "zero"])
@pytest.mark.parametrize("architecture", ["parallel", "folded", "serial"])
def test_ten_thousand_restarts_of_random_cores(architecture: str, start: str, tmp_path: Path) -> None:
    chance = random.Random(f"{architecture}, {start}")
    starts = reloads = judged = 0
    for draw in range(DRAWS):
        found = case(drawn(architecture, start, chance), chance)
        folder = tmp_path / str(draw)
        folder.mkdir()
        outcome = run(folder, found.made, found.sets, STARTS // DRAWS + 100, found.codes, draw)
        check_beats(found, outcome)
        assert false_flags(found, outcome) == 0
        starts += len(outcome.resets)
        reloads += outcome.reloads
        judged += int(np.count_nonzero(outcome.index >= found.made.quantized.settling))
    assert starts >= STARTS
    assert reloads > STARTS // 2
    assert judged > STARTS


@pytest.mark.slow
@pytest.mark.parametrize("start", ["steady", "zero"])
def test_the_locomotive_restarts(start: str, tmp_path: Path) -> None:
    """Its filter takes thousands of samples to settle."""
    spec = load(EXAMPLES / "flange_wear_locomotive.toml")
    limits = WearSpec(initial=(Fraction(4),), warning=Fraction("1.4"), limit=Fraction("1.8"))
    hardware = replace(spec.hardware, architecture="parallel", realization="df1_ef2", reload=True, start=start)
    found = case(design_core(replace(spec, wear=limits, hardware=hardware)), random.Random(3))
    outcome = run(tmp_path, found.made, found.sets, 100, found.codes, 3)
    check_beats(found, outcome)
    assert false_flags(found, outcome) == 0
    assert np.count_nonzero(outcome.index >= found.made.quantized.settling) > 100
