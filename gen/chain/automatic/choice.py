"""The choice of the stages for one of the kind auto: the cheapest structure that is proven to keep to the limits.

All structures are screened (`sosmith.gen.chain.automatic.screen`). Of each family, which has the same kinds of stages
in the same order, the one that is expected to be the cheapest stays. Those that may be the cheapest of all are
designed, as if their tables had been written by hand. Their costs are those of the designs, and the cheapest whose
limits are proven is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sosmith.gen.chain.automatic.limits import SPAN
from sosmith.gen.chain.automatic.screen import Cost, Plan, Problem, Wanted, plan
from sosmith.gen.chain.automatic.stages import tables_of
from sosmith.gen.chain.automatic.structures import MAX_STAGES, structures
from sosmith.gen.chain.design import ChainDesign, StageDesign, design_stages
from sosmith.gen.chain.reading import chain_from_tree
from sosmith.gen.chain.specification import ChainSpec
from sosmith.gen.estimate.estimate import TITLES, USUAL, estimated
from sosmith.gen.fpga.boards import Board, Device, find_board
from sosmith.gen.specification.choices import AUTO
from sosmith.gen.specification.combinations import CIC_DECIMATE, FIR_DECIMATE, PARALLEL, asked_by
from sosmith.gen.specification.specification import Specification
from sosmith.gen.specification.toml_text import toml_text
from sosmith.model.errors import ShortfallError, SpecificationError

_MOST_DESIGNS = 4
"""Structures that are designed, not counting those that turn out to be out of question."""

_LITTLE = 1.08
"""How many times more than there is a structure may be expected to need, and yet be designed if no other is left."""

_MOST_ROUNDS = 4
"""How often other structures are designed where none of those that were is proven."""

_UNSURE = 1.15
"""How many times the expected cost of the first design another may be expected to take, and yet be designed.

One that is expected to take less than the cheapest design is designed as well.
"""

_FINER = 4
"""Bits of a port between two stages beyond those of the largest input in units of the error allowed."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Looked:
    """A structure that was looked at.

    Attributes
    ----------
    structure : str
        What it is.
    cost : Cost or None
        Of the design; expected, if it was not designed; None if it is out of question.
    weighed : float or None
        The same in LUT4, with multiplier blocks and memory as shares of the FPGA.
    designed : bool
        Whether `cost` is that of a design.
    verdict : str
        Why it was not taken; "taken" for the one that was.
    """

    structure: str
    cost: Cost | None
    weighed: float | None
    designed: bool
    verdict: str

    def as_dict(self) -> dict[str, Any]:
        """Return it in the types of JSON."""
        luts, blocks, bits = (None, None, None) if self.cost is None else (round(each) for each in self.cost)
        return {
            "structure": self.structure,
            "luts": luts,
            "multipliers": blocks,
            "memory_bits": bits,
            "designed": self.designed,
            "verdict": self.verdict,
        }


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The stages that were chosen, designed, and what else was looked at, the cheapest first."""

    design: ChainDesign
    device: Device
    looked: tuple[Looked, ...]


@dataclass(kw_only=True)
class _Candidate:
    plan: Plan
    design: ChainDesign | None = None
    cost: Cost | None = None


def choose_stages(spec: ChainSpec, *, board: Board | None = None, progress: Progress = lambda step: None) -> Choice:
    """Choose and design the stages for a specification with one of the kind auto.

    Raises
    ------
    ShortfallError
        If no structure keeps to the limits, with what comes closest.
    SpecificationError
        If the hardware that is asked for takes no filter that decimates.
    """
    return _Search(spec, board, progress).chosen()


def _takes_each_clock(spec: Specification) -> bool:
    """Say whether filters that decimate may take a sample at each clock beside what a specification asks for."""
    wanted, asked = spec.hardware.architecture, asked_by(spec)
    return wanted in {AUTO, PARALLEL.name} and all(
        PARALLEL.takes((*asked, each)) for each in (CIC_DECIMATE, FIR_DECIMATE)
    )


class _Search:
    """The structures for one specification."""

    def __init__(self, spec: ChainSpec, board: Board | None, progress: Progress) -> None:
        base = spec.base
        assert spec.limits is not None
        (self.place,) = (k for k, each in enumerate(spec.stages) if each.kind == AUTO)
        stage, behind = spec.stages[self.place], len(spec.stages) - self.place - 1
        self.spec, self.name, self.board, self.progress = spec, stage.name, board, progress
        estimates = board is not None and board.device.family in TITLES
        self.for_costs = board if board is not None and estimates else find_board(USUAL[0])
        self.wanted = Wanted(
            limits=spec.limits,
            rate=stage.rate,
            factor=stage.factor,
            clock=base.hardware.clock,
            channels=base.channels,
            input_bits=_between(spec) if self.place else base.inputs[0].bits,
            output_bits=_between(spec) if behind else base.output.bits,
            between_bits=_between(spec),
            exact_bits=max(1, base.output.bits - math.floor(math.log2(base.max_error / base.output.lsb))),
            each_clock=_takes_each_clock(base),
        )

    @property
    def device(self) -> Device:
        """The FPGA of which costs are told."""
        return self.for_costs.device

    def chosen(self) -> Choice:
        """Screen, design and prove."""
        self.progress("structures")
        families = self._families()
        candidates = [_Candidate(plan=plans.pop(0)) for plans in families]
        taken = None
        for _ in range(_MOST_ROUNDS):
            self._design(candidates)
            taken = self._cheapest_proven(candidates)
            if taken is not None:
                break
            if all(each.plan.problem is not None for each in candidates):
                others = [plans.pop(0) for plans in families if plans and plans[0].problem is None]
                candidates += [_Candidate(plan=each) for each in others]
                if not others:
                    self._give_a_chance(candidates)
        if taken is None or taken.design is None:
            raise ShortfallError(
                f"stage {self.name}: its limits must be such that a structure of stages keeps to them, and none does: "
                f"{_closest([each.plan for each in candidates])}"
            )
        return Choice(design=taken.design, device=self.device, looked=tuple(self._looked(candidates, taken)))

    def _give_a_chance(self, candidates: Sequence[_Candidate]) -> None:
        """Leave it to a design whether those that miss a limit by little do so: lengths are estimates."""
        for each in candidates:
            problem = each.plan.problem
            if problem is not None and problem.times <= _LITTLE and problem.estimated:
                each.plan.problem = None

    def _families(self) -> list[list[Plan]]:
        """Return the plans of each family, in each and of all the most promising one first."""
        families: dict[tuple[str, ...], list[Plan]] = {}
        for each in structures(self.wanted.factor, MAX_STAGES + 1 - len(self.spec.stages)):
            families.setdefault(each.family, []).append(plan(each, self.wanted, self.device))
        for plans in families.values():
            plans.sort(key=self._order)
        return sorted(families.values(), key=lambda plans: self._order(plans[0]))

    def _order(self, each: Plan) -> tuple[float, float]:
        if each.problem is not None:
            return each.problem.times, 0.0
        return 0.0, each.cost.weighed(self.device)

    def _design(self, candidates: Sequence[_Candidate]) -> None:
        """Design what may be the cheapest."""
        found: list[tuple[float, float]] = []
        for each in sorted(candidates, key=lambda one: self._order(one.plan)):
            expected = each.plan.cost.weighed(self.device)
            if each.plan.problem is not None or len(found) >= _MOST_DESIGNS:
                return
            if each.cost is not None:
                continue
            if found and expected > max(_UNSURE * found[0][0], min(cost for _, cost in found)):
                return
            self.progress(str(each.plan.structure))
            self._design_one(each)
            if each.cost is not None:
                found.append((expected, each.cost.weighed(self.device)))

    def _design_one(self, candidate: _Candidate) -> None:
        tables = tables_of(candidate.plan, self.wanted, self.name)
        if isinstance(tables, Problem):
            candidate.plan.against(tables)
            return
        try:
            design = design_stages(
                self._written(tables),
                board=self.board,
                progress=lambda step: self.progress(f"{candidate.plan.structure}: {step}"),
            )
        except (ShortfallError, SpecificationError) as error:
            candidate.plan.against(Problem(1.0, str(error).removeprefix(f"{self.spec.base.path}: ")))
            return
        candidate.design = design
        candidate.cost = cost_of(design.stages[self.place : self.place + len(tables)], self.for_costs)

    def _written(self, tables: Sequence[dict[str, Any]]) -> ChainSpec:
        """Return the specification of stages in place of the one that was asked for."""
        source, k = self.spec.tree, self.place
        asked = source["stage"]
        limits = {key: value for key, value in asked[k].items() if key not in {"name", "kind", "decimate"}}
        if len(asked) > 1:
            limits |= dict(zip(SPAN, (tables[0]["name"], tables[-1]["name"]), strict=True))
        tree: dict[str, Any] = {}
        for key, value in source.items():
            if key == "stage":
                tree |= {"stage": [*asked[:k], *tables, *asked[k + 1 :]], "limits": limits}
            else:
                tree[key] = value
        head = f"# The stages were chosen for {self.name}, of the kind auto.\n"
        chain = chain_from_tree(tree, self.spec.base.path, head + toml_text(tree))
        return replace(chain, is_written=True)

    def _cheapest_proven(self, candidates: Sequence[_Candidate]) -> _Candidate | None:
        designed = [each for each in candidates if each.cost is not None and each.plan.problem is None]
        for each in sorted(designed, key=self._weighed):
            assert each.design is not None
            self.progress(f"{each.plan.structure}: limits of the whole")
            excess = each.design.excess
            if not excess:
                return each
            each.plan.against(Problem(1.0, "; ".join(excess)))
        return None

    def _weighed(self, each: _Candidate) -> float:
        cost = each.cost if each.cost is not None else each.plan.cost
        return cost.weighed(self.device)

    def _looked(self, candidates: Sequence[_Candidate], taken: _Candidate) -> list[Looked]:
        rows = []
        least = self._weighed(taken)
        for each in sorted(candidates, key=lambda one: (one.plan.problem is not None, self._weighed(one))):
            problem, cost = each.plan.problem, each.cost
            weighed = self._weighed(each)
            if each is taken:
                verdict = "taken"
            elif problem is not None:
                verdict = problem.text
            else:
                verdict = (
                    f"dearer, {weighed / least:.2f} ×" if weighed >= least else "not designed, as others seemed cheaper"
                )
            shown = cost if cost is not None or problem is not None else each.plan.cost
            rows.append(
                Looked(
                    structure=str(each.plan.structure),
                    cost=shown,
                    weighed=None if shown is None else weighed,
                    designed=cost is not None,
                    verdict=verdict,
                )
            )
        return rows


def _between(spec: ChainSpec) -> int:
    """Return how many bits ports between stages are expected to have: for all inputs, in fine steps of the output's."""
    base = spec.base
    port = base.output if len(base.inputs) > 1 else base.inputs[0]
    reach = max(abs(port.zero + port.lsb * code) for code in (port.lowest, port.highest + 1))
    return max(2, math.ceil(math.log2(reach / base.max_error)) + _FINER)


def _closest(plans: Sequence[Plan]) -> str:
    """Say what stands in the way of the structure that comes closest."""
    found = [(each.problem, each.structure) for each in plans if each.problem is not None]
    problem, structure = min(found, key=lambda each: each[0].times)
    return f"the closest is {structure}, {problem.text}"


def cost_of(stages: Sequence[StageDesign], board: Board) -> Cost:
    """Return what the cores of stages take together, by the estimate of each."""
    total = Cost(0, 0, 0)
    for stage in stages:
        for core in stage.cores:
            each = estimated(core.architecture, board)
            assert each is not None
            total = Cost(
                total.luts + each.luts, total.blocks + each.multiplier_blocks, total.memory_bits + each.memory_bits
            )
    return total
