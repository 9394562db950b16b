"""Chooses the realization: plans, trims and proves the candidates, each at most once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from sosmith.gen.realizations.kept_formats import kept_or_made
from sosmith.gen.realizations.registry import BEST_KEPT, REALIZATIONS, realizations_for
from sosmith.gen.word_lengths.exchanges import in_better_order, may_be_ordered
from sosmith.gen.word_lengths.objective import Objective
from sosmith.gen.word_lengths.quantize import Plan, prove
from sosmith.gen.word_lengths.quantized import Quantized
from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.errors import ShortfallError

Progress = Callable[[str], None]
Best = tuple[float, str]
"""The size of a realization that is proven, and its name."""

Accept = Callable[[Datapath], object]
"""Raises ShortfallError, with the reason, if a datapath does not suit the hardware."""


class Selection:
    """Candidate realizations of one design.

    Parameters
    ----------
    plan_of : callable
        Plans a realization, given its name; may raise ShortfallError.
    floor_of : callable
        Bounds the size of a realization from below without planning it; may raise ShortfallError.
    objective : Objective
        The size to be made small.
    progress : callable
        Called with the name of each step.
    accept : callable
        Raises ShortfallError, with the reason, if a datapath does not suit the hardware.
    key : tuple
        All that `floor_of` and `accept` depend on besides, with equal representations if equal.
    fir : bool
        Whether the filter is an FIR filter, which has other realizations than second-order sections.
    """

    def __init__(
        self,
        plan_of: Callable[[str], Plan],
        floor_of: Callable[[str], float],
        objective: Objective,
        progress: Progress,
        *,
        accept: Accept,
        key: tuple[object, ...],
        fir: bool = False,
    ) -> None:
        self._realizations = realizations_for(fir=fir)
        self._plan_of = plan_of
        self._floor_of = floor_of
        self._objective = objective
        self._progress = progress
        self._accept = accept
        self._key = key
        self._plans: dict[str, Plan] = {}
        self._trimmed: set[str] = set()
        self._ordered: set[str] = set()
        self._proven: dict[str, Quantized] = {}
        self._failures: dict[str, str] = {}
        self._sizes: dict[str, float] = {}
        self._trusting = True

    def proven(self, name: str) -> Quantized:
        """Plan, trim and prove the realization `name`.

        Raises
        ------
        ShortfallError
            If it cannot meet the specification, or does not suit the objective.
        """
        self._floor_of(name)
        self._plan(name)
        if name in self._failures:
            raise ShortfallError(self._failures[name])
        self._trim(name)
        self._order(name)
        return self._prove(name)

    def cheapest(self) -> tuple[Quantized, str]:
        """Return the proven realization of the smallest size that is accepted, and the reason.

        Realizations are planned in the order of their least possible sizes, those that are no cascades last, until no
        remaining one can be smaller. Plans that are not much larger than the smallest are trimmed. They are proven in
        the order of their planned sizes until no remaining plan promises to be smaller. What size they come to is kept
        from one command to the next; the smallest one is proven each time.

        Raises
        ------
        ShortfallError
            If none meets the specification; gives the reason of `BEST_KEPT`, or of the first that suits the
            architecture, by name if the reasons differ.
        """
        failures: dict[str, str] = {}
        floors = self._floors(failures)
        unsuited = {*failures}
        best: Best | None = None
        while promising := self._promising(floors, math.inf if best is None else best[0], failures):
            best = self._smallest(promising, best, failures)
        if best is None:
            suited = [name for name in failures if name not in unsuited] or [*failures]
            best_kept = BEST_KEPT if BEST_KEPT in suited else suited[0]
            with_best = "" if len(set(failures.values())) == 1 else f"with {best_kept}, "
            raise ShortfallError(
                f"none of the {len(failures)} realizations meets the specification: {with_best}{failures[best_kept]}"
            )
        size, name = best
        if name not in self._proven and not self._is_as_kept(name, size):
            self._begin_anew()
            return self.cheapest()
        quantized = self._proven[name]
        return quantized, self._reason(quantized, {*failures} - unsuited, unsuited, [*floors])

    def _floors(self, failures: dict[str, str]) -> dict[str, float]:
        """Least sizes of all realizations, in the order of planning."""
        floors: dict[str, float] = {}
        key = "least", self._objective, self._key
        bounds: dict[str, tuple[float, str | None]] = kept_or_made(key, self._bounds, dict, dict)
        for name, (floor, reason) in bounds.items():
            if reason is None:
                floors[name] = floor
            else:
                failures[name] = reason
        return dict(sorted(floors.items(), key=lambda item: (not REALIZATIONS[item[0]].cascade, item[1])))

    def _bounds(self) -> dict[str, tuple[float, str | None]]:
        """Least sizes of all realizations; for those that do not suit, the reason."""
        bounds: dict[str, tuple[float, str | None]] = {}
        for name in self._realizations:
            try:
                bounds[name] = self._floor_of(name), None
            except ShortfallError as error:
                bounds[name] = 0.0, str(error)
        return bounds

    def _promising(self, floors: dict[str, float], least: float, failures: dict[str, str]) -> list[str]:
        """Plan and trim those that may be smaller than `least`, and take them from `floors`."""
        names: list[str] = []
        while new := _next(floors, least):
            for name in new:
                del floors[name]
                self._plan(name)
                if name in self._plans:
                    names.append(name)
                else:
                    failures[name] = self._failures[name]
            for name in sorted((name for name in new if name in self._plans), key=self._size):
                if self._size(name) <= self._objective.hopeless * least:
                    self._trim(name)
                    least = min(least, self._size(name))
        return names

    def _smallest(self, names: list[str], best: Best | None, failures: dict[str, str]) -> Best | None:
        """Look at those that promise to be smaller than the best one so far."""
        for name in sorted(names, key=self._size):
            if best is not None and self._size(name) >= best[0]:
                break
            self._order(name)
            try:
                size = self._sizes[name] = self._size_once_proven(name)
            except ShortfallError as error:
                failures[name] = str(error)
                continue
            if best is None or size < best[0]:
                best = size, name
        return best

    def _size_once_proven(self, name: str) -> float:
        """Return the size of a realization that is proven and accepted, now or in an earlier command.

        Raises
        ------
        ShortfallError
            If it cannot meet the specification, or is not accepted.
        """

        def prove_it() -> float:
            quantized = self._prove(name)
            self._accept(quantized.datapath)
            return self._objective.of_datapath(quantized.datapath)

        planned = self._plans[name].key if self._trusting else None
        if planned is None:
            return prove_it()
        return kept_or_made(("proven", self._objective, planned, self._key), prove_it, float, float)

    def _is_as_kept(self, name: str, size: float) -> bool:
        """Prove a realization, and say whether what is kept of it holds."""
        try:
            quantized = self._prove(name)
            self._accept(quantized.datapath)
        except ShortfallError:
            return False
        return self._objective.of_datapath(quantized.datapath) == size

    def _begin_anew(self) -> None:
        """Leave nothing that a size which does not hold has led to."""
        self._trusting = False
        for known in (self._plans, self._failures, self._sizes):
            known.clear()
        self._trimmed.clear()
        self._ordered.clear()

    def _reason(self, quantized: Quantized, failures: set[str], unsuited: set[str], dropped: list[str]) -> str:
        short = {*failures, *(name for name in self._plans if self._size(name) == math.inf)}
        left = sorted((n for n in self._plans if n not in {quantized.realization, *short}), key=self._size)
        count = 1 + len(left) + len(dropped)
        why = f"{self._objective.best} of {count}" if count > 1 else "the only one proven"
        reason = f"{quantized.realization}: {why}, {self._objective.size_text(quantized.datapath)}"
        others = [
            ", ".join(f"{name} {round(self._known_size(name)):,}" for name in left),
            f"{self._objective.beyond}: {', '.join(name for name in self._realizations if name in dropped)}"
            if dropped
            else "",
            f"{self._objective.unsuited}: {', '.join(name for name in self._realizations if name in unsuited)}"
            if unsuited
            else "",
            _falling_short([name for name in self._realizations if name in short]),
        ]
        rest = "; ".join(other for other in others if other)
        return f"{reason} ({rest})" if rest else reason

    def _size(self, name: str) -> float:
        return self._plans[name].size

    def _known_size(self, name: str) -> float:
        """Size as proven, if it was: a proof may have needed longer words than were planned."""
        return self._sizes.get(name, self._size(name))

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

    def _order(self, name: str) -> None:
        """Exchange sections of a trimmed plan where that makes it smaller."""
        if name not in self._ordered and may_be_ordered(self._plans[name]):
            self._progress(f"order of sections, {name}")
            self._plans[name] = in_better_order(self._plans[name])
            self._ordered.add(name)

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


def _next(floors: Mapping[str, float], least: float) -> list[str]:
    """Names of the first least size that is below `least`, none if there is none."""
    names = [name for name, floor in floors.items() if floor < least]
    return [name for name in names if REALIZATIONS[name].cascade and floors[name] == floors[names[0]]] or names[:1]


def _falling_short(names: list[str]) -> str:
    if not names:
        return ""
    return f"{names[0]} falls short" if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]} fall short"
