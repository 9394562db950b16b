"""Lack of fit: scatter is not taken for a curve, and a curve is not taken for scatter."""

import numpy as np
import pytest

from sosmith.instrument.calibration.lack_of_fit import lack_of_fit


def test_pure_scatter_is_hardly_ever_taken_for_a_curve() -> None:
    generator = np.random.default_rng(1)
    found = [lack_of_fit(*generator.normal(0, 0.3, (3, 40))) for _ in range(1000)]
    assert sum(one.structured for one in found) <= 3
    assert np.mean([one.pure for one in found]) == pytest.approx(0.3, rel=0.08)


@pytest.mark.parametrize(("along", "index"), [("voltage", 0), ("temperature", 1)])
def test_a_curve_is_found_with_its_size(along: str, index: int) -> None:
    generator = np.random.default_rng(2)
    at = generator.uniform(0, 1, (2, 200))
    curve = 0.4 * (6 * at[index] * (1 - at[index]) - 1)
    found = lack_of_fit(curve + generator.normal(0, 0.1, 200), at[0], at[1])
    assert found.structured
    assert found.along == along
    assert found.pure == pytest.approx(0.1, rel=0.1)
    assert found.missed == pytest.approx(float(np.std(curve)), rel=0.1)
    assert found.warning == (
        f"the residuals follow a curve along the {along} of about {found.missed:.2g} mm rms that the fit misses: "
        f"neighbours differ by a scatter of {found.pure:.2g} mm rms only"
    )


def test_exact_residuals_have_no_structure() -> None:
    found = lack_of_fit(np.zeros(10), np.arange(10.0), np.arange(10.0))
    assert (found.structured, found.missed, found.warning) == (False, 0.0, "")
