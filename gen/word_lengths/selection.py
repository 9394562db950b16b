"""Chooses the realization: plans, trims and proves the candidates, each at most once."""

from __future__ import annotations

import math
from collections.abc import Callable

from sosmith.gen.realizations.registry import BEST_KEPT, REALIZATIONS
from sosmith.gen.word_lengths.cost import LUTS_OF_A_BLOCK, cost_of
from sosmith.gen.word_lengths.quantize import Plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError

Progress = Callable[[str], None]
Accept = Callable[[Datapath], object]
"""Raises ShortfallError, with the reason, if a datapath does not suit the hardware."""

_HOPELESS = 2.5
"""Ratio to the smallest area beyond which a plan is not trimmed: trimming saved less than half in every design seen."""


class Selection:
    """Candidate realizations of one design.

    Parameters
    ----------
    plan_of : callable
        Plans a realization, given its name; may raise ShortfallError.
    progress : callable
        Called with the name of each step.
    """

    def __init__(self, plan_of: Callable[[str], Plan], progress: Progress) -> None:
        self._plan_of = plan_of
        self._progress = progress
        self._plans: dict[str, Plan] = {}
        self._trimmed: set[str] = set()
        self._proven: dict[str, Quantized] = {}
        self._failures: dict[str, str] = {}

    def proven(self, name: str) -> Quantized:
        """Plan, trim and prove the realization `name`.

        Raises
        ------
        ShortfallError
            If it cannot meet the specification.
        """
        self._plan(name)
        if name in self._failures:
            raise ShortfallError(self._failures[name])
        self._trim(name)
        return self._prove(name)

    def cheapest(self, accept: Accept) -> tuple[Quantized, str]:
        """Return the proven realization with the smallest estimated area that `accept` permits, and the reason.

        Plans that are not much larger than the smallest are trimmed. They are proven in the order of their planned
        areas until no remaining plan promises to be smaller.

        Raises
        ------
        ShortfallError
            If none meets the specification; gives the reason of `BEST_KEPT`, by name if the reasons differ.
        """
        for name in REALIZATIONS:
            self._plan(name)
        failures = dict(self._failures)
        least = math.inf
        for name in sorted(self._plans, key=self._area):
            if self._area(name) <= _HOPELESS * least:
                self._trim(name)
                least = min(least, self._area(name))
        order = sorted((name for name in self._plans if name not in failures), key=self._area)
        best: tuple[float, Quantized] | None = None
        for name in order:
            if best is not None and self._area(name) >= best[0]:
                break
            try:
                quantized = self._prove(name)
                accept(quantized.datapath)
            except ShortfallError as error:
                failures[name] = str(error)
                continue
            found = cost_of(quantized.datapath).area
            if best is None or found < best[0]:
                best = found, quantized
        if best is None:
            with_best = "" if len(set(failures.values())) == 1 else f"with {BEST_KEPT}, "
            raise ShortfallError(
                f"none of the {len(failures)} realizations meets the specification: {with_best}{failures[BEST_KEPT]}"
            )
        return best[1], self._reason(best, order, {*failures})

    def _reason(self, best: tuple[float, Quantized], order: list[str], failures: set[str]) -> str:
        area, quantized = best
        short = {*failures, *(name for name in order if self._area(name) == math.inf)}
        left = [name for name in order if name not in {quantized.realization, *short}]
        why = f"the smallest estimated area of {len(left) + 1}" if left else "the only one proven"
        reason = (
            f"{quantized.realization}: {why}, {round(area):,} LUT4 with a multiplier block counted as {LUTS_OF_A_BLOCK}"
        )
        others = [
            ", ".join(f"{name} {round(self._known_area(name)):,}" for name in left),
            _falling_short([name for name in REALIZATIONS if name in short]),
        ]
        rest = "; ".join(other for other in others if other)
        return f"{reason} ({rest})" if rest else reason

    def _area(self, name: str) -> float:
        return self._plans[name].area

    def _known_area(self, name: str) -> float:
        """Area as proven, if it was: a proof may have needed longer words than were planned."""
        return cost_of(self._proven[name].datapath).area if name in self._proven else self._area(name)

    def _plan(self, name: str) -> None:
        if name in self._plans or name in self._failures:
            return
        try:
            self._plans[name] = self._plan_of(name)
        except ShortfallError as error:
            self._failures[name] = str(error)

    def _trim(self, name: str) -> None:
        if name in self._trimmed:
            return
        self._progress(f"trimming, {name}")
        self._plans[name] = self._plans[name].trimmed()
        self._trimmed.add(name)

    def _prove(self, name: str) -> Quantized:
        if name in self._failures:
            raise ShortfallError(self._failures[name])
        if name not in self._proven:
            self._progress(f"proof, {name}")
            try:
                self._proven[name] = prove(self._plans[name])
            except ShortfallError as error:
                self._failures[name] = str(error)
                raise
        return self._proven[name]


def _falling_short(names: list[str]) -> str:
    if not names:
        return ""
    return f"{names[0]} falls short" if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]} fall short"
