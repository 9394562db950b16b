"""Names of realizations with look-ahead: true of recursions that go back that far, and of no others."""

import pytest
from tests.verify.parallel.cores import looking_ahead, small
from tests.verify.small_specifications import PLAIN

from sosmith.verify.certificate_file import Certificate, Operation
from sosmith.verify.verdict.recursions import Recursion, is_realized_as, recursions_of

WIDE = PLAIN.replace("bits = 8", "bits = 18")
NAMES = ("df1", "df1_ef1", "df1_ef2", "df2t", "delta", "state_space", "normal", "lattice_wdf", "fir_transposed")


def drops(part: Recursion) -> bool:
    """Whether the output has fewer bits than the sum before it."""
    return part.stage.nodes[part.output].op is Operation.FLOOR


@pytest.mark.parametrize(("spec", "multipliers", "drops_bits"), [(PLAIN, 0, True), (WIDE, 20, False)])
def test_a_recursion_is_known_by_how_far_it_goes_back(spec: str, multipliers: int, drops_bits: bool) -> None:
    """Whether its sum drops bits, or its products have dropped them."""
    core = looking_ahead(spec, multipliers=multipliers)
    found = recursions_of(core.certificate)
    assert [drops(part) for section in found for part in section if part.loop] == [drops_bits]
    assert is_realized_as("look_ahead_3", found)
    others = *NAMES, *(f"look_ahead_{other}" for other in (1, 2, 4, 6, 12))
    assert not any(is_realized_as(name, found) for name in others)


def certificates() -> list[Certificate]:
    """Return those of direct forms that go back two samples, one of them with nothing in between."""
    quarter = PLAIN.replace('kind = "lowpass", order = 2, cutoff = 20.0', 'kind = "lowpass", order = 2, cutoff = 25.0')
    assert quarter != PLAIN
    return [small(spec, realization).certificate for spec in (PLAIN, quarter) for realization in ("df1", "df1_ef2")]


@pytest.mark.parametrize("number", range(4))
def test_a_direct_form_does_not_look_ahead(number: int) -> None:
    found = recursions_of(certificates()[number])
    assert not any(is_realized_as(f"look_ahead_{distance}", found) for distance in (1, 2, 3, 4))
