"""The verifier's own proof of the largest gain in each band: of the generator's claims, and against others."""

import math
import re
from fractions import Fraction
from types import ModuleType

import pytest
from tests.formal.prover import broken
from tests.gen.filter.gains import CASES, made

from sosmith.gen.filter import largest_gain
from sosmith.gen.filter.decimation import PLACES
from sosmith.verify.bounds.largest_gain import check_bands
from sosmith.verify.certificate_file import BandEntry, DecimationEntry, SectionEntry, on_grid
from sosmith.verify.graph import RejectedError

Case = tuple[str, int, int, int, str]


def claimed(case: Case, module: ModuleType = largest_gain) -> tuple[DecimationEntry, list[SectionEntry]]:
    """Return what a certificate says of a filter's bands."""
    found, filter_ = made(*case)
    peaks = module.band_gains(filter_.exact, found.factor, found.stages)
    edge = Fraction(math.ceil(found.edge / found.rate * PLACES), PLACES)
    into = module.passband_gains(filter_.exact, found.factor, found.stages, edge, found.factor // 2)
    entry = DecimationEntry(
        factor=found.factor,
        stages=found.stages,
        width=32,
        dropped=0,
        correction=found.correction,
        edge=found.edge / found.sample_rate,
        aliasing=(),
        passing=tuple(BandEntry(gain=on_grid(peak.gain), at=peak.at) for peak in into),
        bands=tuple(BandEntry(gain=on_grid(peak.gain), at=peak.at) for peak in peaks),
    )
    return entry, [SectionEntry(numerator=b, denominator=a) for b, a in filter_.exact]


def with_band(entry: DecimationEntry, band: int, **changes: Fraction) -> DecimationEntry:
    bands = list(entry.bands)
    bands[band - 1] = bands[band - 1].model_copy(update=changes)
    return entry.model_copy(update={"bands": tuple(bands)})


@pytest.mark.sweep(2)
@pytest.mark.parametrize("case", CASES)
def test_claims_are_proven_and_others_rejected(case: Case) -> None:
    """A claim is at most a thousandth too high; two thousandths off are too much, both ways."""
    entry, sections = claimed(case)
    check_bands(entry, sections)
    for band in {1, entry.factor // 2}:
        gain = entry.bands[band - 1].gain
        less = with_band(entry, band, gain=gain * Fraction(998, 1000))
        with pytest.raises(RejectedError, match=rf"^the largest gain from band {band} must be at least \d"):
            check_bands(less, sections)
        more = with_band(entry, band, gain=gain * Fraction(1002, 1000) + Fraction(1, 2**62))
        with pytest.raises(RejectedError, match=rf"^the largest gain from band {band} must be that at \d"):
            check_bands(more, sections)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("case", CASES)
def test_claims_of_the_pass_band(case: Case) -> None:
    """They are of decimator and filter together; two thousandths off are too much, both ways."""
    entry, sections = claimed(case)
    for band in {1, entry.factor // 2}:
        for factor, sentence in ((998, r"must be at least \d"), (1002, r"must be that at \d")):
            passing = list(entry.passing)
            gain = passing[band - 1].gain * Fraction(factor, 1000) + Fraction(factor > 1000, 2**62)
            passing[band - 1] = passing[band - 1].model_copy(update={"gain": gain})
            wrong = entry.model_copy(update={"passing": tuple(passing)})
            with pytest.raises(
                RejectedError, match=rf"^the largest gain into the pass band from band {band} {sentence}"
            ):
                check_bands(wrong, sections)
    with pytest.raises(RejectedError, match=r"^largest gains into the pass band must be given of \d+ bands, not 0$"):
        check_bands(entry.model_copy(update={"passing": ()}), sections)


def test_sentences() -> None:
    entry, sections = claimed(CASES[0])

    def rejected(wrong: DecimationEntry, sentence: str) -> None:
        with pytest.raises(RejectedError, match=f"^{re.escape(sentence)}$"):
            check_bands(wrong, sections)

    rejected(
        with_band(entry, 1, gain=Fraction(1, 2**19)),
        "the largest gain from band 1 must be at least 2.41949e-06, which is reached at 0.0398931 of the lower rate, "
        "not 1.90735e-06",
    )
    rejected(
        with_band(entry, 1, gain=Fraction(1, 2**18)),
        "the largest gain from band 1 must be that at 87/2048 of the lower rate, 2.53968e-06, or little more, not "
        "3.8147e-06",
    )
    rejected(
        with_band(entry, 1, at=Fraction(1, 8)),
        "the largest gain from band 1 must be that at 1/8 of the lower rate, 1.31187e-07, or little more, not "
        "2.54216e-06",
    )
    rejected(
        with_band(entry, 8, at=Fraction(5, 8)),
        "band 8 must have its largest gain at 0 to 1/2 of the lower rate, not at 5/8",
    )
    rejected(entry.model_copy(update={"bands": entry.bands[:-1]}), "largest gains must be given of 8 bands, not 7")


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("((band - q) / factor)", "((band + q) / factor)"), (" ** stages for q", " ** (stages + 1) for q")],
)
def test_a_generator_that_errs_is_found_out(right: str, wrong: str) -> None:
    entry, sections = claimed(CASES[5], broken(largest_gain, right, wrong))
    with pytest.raises(RejectedError, match=r"^the largest gain from band 1 must be at least "):
        check_bands(entry, sections)


@pytest.mark.parametrize("by", [Fraction(1, 2**64), Fraction(-1, 2**64), Fraction(1, 3 * 2**90), Fraction(1, 2**40)])
def test_no_digit_of_a_gain_is_free(by: Fraction) -> None:
    """The bound is proven with a share to spare, of which nothing may be used."""
    entry, sections = claimed(CASES[1])
    gain = entry.bands[0].gain
    sentence = (
        rf"^the largest gain from band 1 must be (that at \d.*, or little more|{gain}, which follows from).*, not "
    )
    with pytest.raises(RejectedError, match=sentence):
        check_bands(with_band(entry, 1, gain=gain + by), sections)


def test_another_place_asks_for_another_gain() -> None:
    entry, sections = claimed(CASES[1])
    for by in (Fraction(1, 2**32), Fraction(-1, 2**32)):
        with pytest.raises(RejectedError, match=r"^the largest gain from band 1 must be "):
            check_bands(with_band(entry, 1, at=entry.bands[0].at + by), sections)
    with pytest.raises(RejectedError, match=r"^band 1 must have its largest gain at a multiple of 1/4294967296 of the"):
        check_bands(with_band(entry, 1, at=entry.bands[0].at + Fraction(1, 2**60)), sections)


def test_a_certificate_without_such_claims() -> None:
    entry, sections = claimed(CASES[0])
    with pytest.raises(RejectedError, match=r"^largest gains must be given of 8 bands, not 0$"):
        check_bands(entry.model_copy(update={"bands": ()}), sections)


def test_another_filter_has_other_gains() -> None:
    entry, sections = claimed(CASES[2])
    with pytest.raises(RejectedError, match=r"^the largest gain from band 1 must be "):
        check_bands(entry, sections[:-1])
