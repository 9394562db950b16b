"""Decides whether two forms are the same word for all values of their variables, by cases if need be.

Equal normal forms are the same value. Others may be as well, where bits decide: a limit is found by a comparison in the
graph, and by two bits of the sum in the hardware. Then the range of an innermost floor with few values is halved, and
each half decided by itself.
"""

from __future__ import annotations

from sosmith.verify.parallel.forms import Forms
from sosmith.verify.program.normal_form import Form, constant, plus

_MOST_VALUES, _MOST_CASES = 64, 10
"""Most values of a floor that is halved, and how often that is done for one comparison, one inside the other."""


def same_word(forms: Forms, a: Form, b: Form, width: int) -> bool:
    """Whether two forms are proven to be the same word of `width` bits; False if that is not so or not found."""
    difference = plus(a, b, -1)
    return any(_is_zero(forms, difference, width, _MOST_CASES, finest=finest) for finest in (False, True))


def _is_zero(forms: Forms, difference: Form, width: int, cases: int, *, finest: bool) -> bool:
    """Decide by cases of the floor with the fewest values, the first of them or the finest.

    The sign of a sum says that of its floor, but not the other way round.
    """
    rest = {monomial: value for monomial, value in _pinned(forms, difference).items() if value % (1 << width)}
    if not rest:
        return True
    if not cases:
        return False
    best: tuple[tuple[int, int], Form, int] | None = None
    for floor in forms.floors(rest):
        low, high = (int(end) for end in forms.limits(floor))
        rank = high - low, -forms.grain(floor) * finest
        if high - low < _MOST_VALUES and (best is None or rank < best[0]):
            best = rank, floor, (low + high) // 2
    if best is None:
        return False
    _, floor, middle = best
    low, high = (int(end) for end in forms.limits(floor))
    for ends in ((low, middle), (middle + 1, high)):
        case = forms.narrowed(floor, *ends)
        if not _is_zero(case, case.settled(rest), width, cases - 1, finest=finest):
            return False
    return True


def _pinned(forms: Forms, difference: Form) -> Form:
    """Return a form with a number in place of a floor and the integers beside it where only one is left for them all.

    By itself the floor may have many values: of a sum with large multiples of an integer, ``floor(a) + j`` is what is
    known, and neither part.
    """
    for monomial, value in difference.items():
        if len(monomial) != 1 or forms.atom(monomial[0]).inside is None:
            continue
        part = {m: other // value for m, other in difference.items() if m and not other % value}
        low, high = forms.limits(part)
        if low == high:
            return _pinned(forms, plus(plus(difference, part, -value), constant(low * value)))
    return difference
