"""Designs of chains, and their uses: compute, generate, prove, simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.chain.automatic.choice import Choice, choose_stages
from sosmith.gen.chain.automatic.facts import looked_table
from sosmith.gen.chain.design import ChainDesign, Folding
from sosmith.gen.chain.design import design_chain as design_stages
from sosmith.gen.chain.facts import chain_tables, limits
from sosmith.gen.chain.generate import chain_certificate, chain_manifest, generate_chain
from sosmith.gen.chain.golden import golden_chain
from sosmith.gen.chain.ideal import chain_gain
from sosmith.gen.chain.top import chain_interface
from sosmith.gen.facts.table import Table, View
from sosmith.gen.fpga.boards import BUILDABLE, PROJECTS, RATE, find_board
from sosmith.interface.arrays import real_numbers
from sosmith.interface.chain.specification import ChainSpecification
from sosmith.interface.design import Codes, Design, Floats
from sosmith.interface.inputs import codes_of, encoded, traces_of
from sosmith.interface.quantity import Quantity
from sosmith.model.arrays import side_by_side
from sosmith.model.errors import SpecificationError, falling_short

if TYPE_CHECKING:
    from sosmith.interface.build import Build
    from sosmith.interface.certificate import Progress
    from sosmith.interface.chain.certificate import ChainCertificate
    from sosmith.interface.chain.filter import ChainFilter
    from sosmith.interface.chain.reload import ChainReload
    from sosmith.interface.chain.report import ChainReport
    from sosmith.interface.trace import Trace


@dataclass(frozen=True)
class Chain(View):
    """A chain of proven stages, with one end-to-end bound, as returned by `design_chain`.

    Values are in physical units. Arrays hold one sample per row, shape (samples,) for one channel and (samples,
    channels) for several; there is one result for every `factor` samples, at the first of them. With stages that
    interpolate, `rise` results come with `factor` samples, the first with the first.

    Examples
    --------
    >>> import numpy as np, sosmith
    >>> chain = sosmith.design_chain({
    ...     "name": "slow",
    ...     "sample_rate": 8000,
    ...     "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    ...     "stage": [
    ...         {"name": "first", "kind": "cic", "order": 2, "decimate": 4},
    ...         {"name": "second", "kind": "fir", "taps": [0.25, 0.5, 0.25]},
    ...     ],
    ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
    ... })
    >>> [stage.name for stage in chain.stages], chain.factor
    (['slow_first', 'slow_second'], 4)
    >>> x = np.sin(2 * np.pi * 50 * np.arange(400) / 8000)
    >>> bool(abs(chain.run(x=x) - chain.run_exact(x=x)).max() <= chain.bound <= chain.specification.max_error)
    True
    """

    core: ChainDesign = field(repr=False)
    """The design in the form of the inner packages."""

    choice: Choice | None = field(default=None, repr=False)
    """What was looked at before the stages were chosen; None for a chain whose stages were given."""

    @property
    def specification(self) -> ChainSpecification:
        """The specification that was designed."""
        return ChainSpecification(self.core.spec)

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.core.name

    @property
    def stages(self) -> tuple[Design, ...]:
        """The stages in order, each a design of its own; of one that interpolates, those of its results in turn."""
        return tuple(Design(core) for stage in self.core.stages for core in stage.cores)

    @property
    def cores(self) -> dict[str, tuple[Design, ...]]:
        """The designs of each stage by its name: one, or those of the results of one that interpolates in turn."""
        return {stage.spec.name: tuple(map(Design, stage.cores)) for stage in self.core.stages}

    @property
    def factor(self) -> int:
        """By how much the stages decimate: input samples of a channel for each result, if none interpolates."""
        return self.core.factor

    @property
    def rise(self) -> int:
        """By how much the stages interpolate: results for each input sample, if none decimates."""
        return self.core.rise

    @property
    def bound(self) -> Quantity:
        """Proven end-to-end bound on ``|hardware - exact|``, for all inputs in range."""
        return self._in_unit(float(self.core.bound))

    @property
    def budget(self) -> dict[str, Quantity]:
        """What each stage adds to `bound`: its own error times `gains`."""
        return {stage.spec.name: self._in_unit(float(stage.share)) for stage in self.core.stages}

    @property
    def gains(self) -> dict[str, float]:
        """Proven factor by which an error at each stage's output grows at most on its way to the end."""
        return {stage.spec.name: float(stage.gain) for stage in self.core.stages}

    @property
    def folding(self) -> dict[str, tuple[float, float]]:
        """Largest gains of aliases, and the frequencies in Hz where they are reached, before anything decimates.

        "anywhere" is for all aliases, "passband" for those that land in the pass band, if a stage states one. Both are
        proven. They are of the stages up to the first one that interpolates; empty if none of these decimates.
        """
        return self._peaks([each for each in self.core.foldings if each.segment.rise == 1])

    @property
    def images(self) -> dict[str, tuple[float, float]]:
        """Largest gains of images, and the frequencies in Hz where they are reached, once all stages have interpolated.

        "anywhere" is for all images, and aliases where stages behind decimate; "passband" for images of the pass band,
        and aliases in it. Both are proven; empty for a chain that does not interpolate.
        """
        return self._peaks([each for each in self.core.foldings if each.segment.rise > 1])

    @property
    def bands(self) -> list[tuple[float, float, float, str]]:
        """Where a sine comes out at another frequency: from and to, in Hz, largest gain in dB, "aliasing" or "image".

        The gains are those of `folding` and `images`, for each part of the chain.
        """
        return limits(self.core)

    @property
    def filter(self) -> ChainFilter:
        """The ideal filters of the stages, as designed: with the decimators that were chosen for stages with poles."""
        from sosmith.interface.chain.filter import ChainFilter

        return ChainFilter(self.core)

    @property
    def passband(self) -> tuple[float, float] | None:
        """Smallest and largest gain in the pass band that limits are given for, proven; None for a chain without."""
        kept = None if self.core.limited is None else self.core.limited.kept
        return None if kept is None else (float(kept.least.gain), float(kept.most.gain))

    @property
    def structures(self) -> list[dict[str, Any]]:
        """What was looked at to choose the stages, the cheapest first; empty for a chain whose stages were given.

        Each has `structure`, `luts`, `multipliers`, `memory_bits` (None if it is out of question), whether these are
        those of a design or expected, `designed`, and the `verdict`.
        """
        return [] if self.choice is None else [each.as_dict() for each in self.choice.looked]

    def _peaks(self, foldings: Sequence[Folding]) -> dict[str, tuple[float, float]]:
        """Return the largest gains of several parts of the chain."""
        found: dict[str, tuple[float, float]] = {}
        for each in foldings:
            highest = each.segment.highest * self.core.spec.base.sample_rate
            for name, peak in (("anywhere", each.anywhere), ("passband", each.passing)):
                if peak is not None and float(peak.gain) > found.get(name, (-1.0, 0.0))[0]:
                    found[name] = float(peak.gain), float(peak.at * highest)
        return found

    @property
    def latency_cycles(self) -> int:
        """Clocks from a sample to its result, of all stages together, at most."""
        return chain_interface(self.core).latency_cycles

    @property
    def clocks_per_sample(self) -> float:
        """Clocks that each sample of a channel takes, on average, at the highest rate: those of the slowest stage."""
        return self.core.clocks_per_sample

    @property
    def scenarios(self) -> dict[str, str]:
        """Descriptions of the built-in traces for this chain, by their names; `trace` and `simulate` take them."""
        return self.stages[0].scenarios

    def trace(self, source: str | PathLike[str] | None = None, *, seconds: float | None = None, seed: int = 1) -> Trace:
        """Make the inputs of a built-in trace, or read those of a file; parameters and errors are those of `Design`."""
        return self.stages[0].trace(source, seconds=seconds, seed=seed)

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """What software needs to know of the chain: the content of ``<name>.json``."""
        return chain_manifest(self.core)

    @cached_property
    def certificate(self) -> ChainCertificate:
        """The claims about the chain; `generate` writes it, and the stages' own, with the digests of all files."""
        from sosmith.interface.chain.certificate import ChainCertificate

        return ChainCertificate(chain_certificate(self.core))

    def frequency_response(self, f: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Return the complex gain from sines at the input to the sines at the output, aliased or not.

        With stages that interpolate, that of sines at the highest rate: of up to half the input's as they are, and of
        images of these.

        Parameters
        ----------
        f : array_like
            Frequencies in Hz.

        Raises
        ------
        SpecificationError
            If a frequency is not a finite real number.
        """
        frequencies = real_numbers(f, "frequencies")
        if not np.isfinite(frequencies).all():
            raise SpecificationError(f"frequencies must be finite, not {frequencies[~np.isfinite(frequencies)][0]}")
        return chain_gain(self.core, frequencies)

    def run(self, **inputs: npt.ArrayLike) -> Floats:
        """Compute the output of the hardware for `inputs` bit for bit, starting from reset.

        Raises
        ------
        SpecificationError
            If an input is missing, unknown, complex or not finite, or the shapes do not fit.
        """
        return self.core.spec.base.output.decode(self._computed(encoded(self._first, inputs)))

    def run_codes(self, **inputs: npt.ArrayLike) -> Codes:
        """Compute as `run` does, but from integer codes to integer codes; errors as there."""
        return self._computed(codes_of(self._first, inputs))

    def run_exact(self, **inputs: npt.ArrayLike) -> Floats:
        """Compute the exact result that `run` approximates: from the same input codes, in double precision."""
        codes = encoded(self._first, inputs)
        block = codes.reshape(len(codes), -1, codes.shape[-1])
        return golden_chain(self.core, block).reshape(-1, *codes.shape[1:-1])

    def generate(self, folder: str | PathLike[str], progress: Progress = lambda step, done, total: None) -> list[Path]:
        """Write the files of all stages, the top that joins them, manifest, C model and certificate.

        Raises
        ------
        SpecificationError
            If the folder cannot be written.
        ToolError
            If Yosys fails, or the disk is full.
        """
        return generate_chain(self.core, Path(fspath(folder)), lambda step: progress(step, 0, 0))

    def package(
        self,
        folder: str | PathLike[str],
        *,
        vlnv: str | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> list[Path]:
        """Write the chain and what other tools need to take it in into `folder`; return the paths of the files.

        Parameters and errors are those of `Design.package`.
        """
        from sosmith.gen.chain.package import package_chain
        from sosmith.gen.output.packages.vlnv import Vlnv

        named = None if vlnv is None else Vlnv.read(vlnv)
        return package_chain(self.core, Path(fspath(folder)), lambda step: progress(step, 0, 0), vlnv=named)

    def build(
        self,
        board: str,
        *,
        folder: str | PathLike[str] | None = None,
        rate: int = RATE,
        progress: Progress = lambda step, done, total: None,
    ) -> Build:
        """Make a bitstream for a board, with the chain behind the serial link, which gets a result for each sample.

        Parameters and errors are those of `Design.build`; a chain must not interpolate, and have at most one stage with
        `reload`.
        """
        from sosmith.gen.chain.board import chain_item
        from sosmith.gen.output.board_build import build_board
        from sosmith.interface.build import Build

        target = find_board(board, BUILDABLE)
        place = Path("build") / self.name / target.name if folder is None else Path(fspath(folder))
        built = build_board(chain_item(self.core), target, rate=rate, progress=lambda step: progress(step, 0, 0))
        return Build.written(built, place)

    def project(
        self,
        board: str,
        *,
        folder: str | PathLike[str] | None = None,
        rate: int = RATE,
        progress: Progress = lambda step, done, total: None,
    ) -> dict[str, Any]:
        """Write a project for the vendor's tools of a board; parameters and errors are those of `Design.project`."""
        from sosmith.gen.chain.board import chain_item
        from sosmith.gen.output.board_project import board_project

        target = find_board(board, PROJECTS)
        place = Path("build") / self.name / target.name if folder is None else Path(fspath(folder))
        project = board_project(chain_item(self.core), target, rate=rate, progress=lambda step: progress(step, 0, 0))
        project.write(place)
        return project.summary

    def cost_on(self, board: str, progress: Progress = lambda step, done, total: None) -> dict[str, Any]:
        """Return what the chain takes of a board's FPGA, with the serial link: as `Design.cost_on`."""
        from sosmith.gen.chain.board import chain_item
        from sosmith.gen.output.board_build import board_cost
        from sosmith.sim.build_cache import cache_folder

        target, cache = find_board(board, BUILDABLE), cache_folder()
        place = None if cache is None else cache.parent / "boards"
        return board_cost(chain_item(self.core), target, place, lambda step: progress(step, 0, 0))

    def reload(
        self,
        other: ChainSpecification | str | PathLike[str] | Mapping[str, Any],
        *,
        reset: bool = False,
        version: int = 1,
        progress: Progress = lambda step, done, total: None,
    ) -> ChainReload:
        """Prove that a stage of the running chain can load the coefficients of another specification.

        Parameters
        ----------
        other : ChainSpecification, path or mapping
            The same chain with other coefficients of one stage, which must have `reload`, or another allowed error.
        reset, version, progress
            As for `Design.reload`.

        Raises
        ------
        SpecificationError
            If the stage cannot reload, or `other` differs in more.
        ShortfallError
            If the set does not fit the stage, the ports behind it or the error allowed.
        """
        from sosmith.interface.chain.reload import ChainReload

        wanted = other if isinstance(other, ChainSpecification) else ChainSpecification.load(other)
        return ChainReload.proven(self.core, wanted.checked, reset=reset, version=version, progress=progress)

    def simulate(
        self,
        trace: str | PathLike[str] | Mapping[str, npt.ArrayLike] | None = None,
        *,
        folder: str | PathLike[str] | None = None,
        seconds: float | None = None,
        simulator: str = "verilator",
        idle: float = 0.3,
        stall: float = 0.3,
        waves: bool = False,
        seed: int = 1,
        progress: Progress = lambda step, done, total: None,
    ) -> ChainReport:
        """Simulate the top with all cores, and compare every result with the integer models and the exact result.

        Parameters are those of `Design.simulate`, and errors too.
        """
        from sosmith.gen.chain.report.report import write_chain_report
        from sosmith.interface.chain.report import ChainReport
        from sosmith.sim.chain import simulate_chain

        for name, share in (("idle", idle), ("stall", stall)):
            if not 0 <= share <= 0.99:
                raise SpecificationError(f"{name} must be from 0 to 0.99, not {share}")
        place = Path("build") / self.name if folder is None else Path(fspath(folder))
        progress("trace", 0, 0)
        traces = traces_of(self._first, trace, seed=seed, seconds=seconds)
        run = simulate_chain(
            self.core,
            side_by_side([each.codes for each in traces]),
            place,
            simulator=simulator,
            seed=seed,
            idle=idle,
            stall=stall,
            waves=waves,
            progress=progress,
        )
        progress("writing the report", 0, 0)
        return ChainReport(write_chain_report(self.core, run, traces, place), place, run)

    def plot(self, path: str | PathLike[str]) -> Path:
        """Draw the gains of the chain and of its stages, and the aliasing limit, into a file; return its path.

        Raises
        ------
        SpecificationError
            If the name ends in neither .svg nor .png, or the folder cannot be written.
        """
        from sosmith.gen.chain.report.picture import chain_plot
        from sosmith.gen.picture import format_of
        from sosmith.model.text_files import write_contents

        target = Path(fspath(path))
        (written,) = write_contents(target.parent, {target.name: chain_plot(self.core, format_of(target))})
        return written

    def tables(self, *, details: bool = False) -> list[Table]:
        """Return what `sosmith design` shows: stages, error budget and aliasing; with `details` each stage's own."""
        tables = [] if self.choice is None else [looked_table(self.core, self.choice)]
        tables += chain_tables(self.core)
        if details:
            for stage in self.stages:
                tables += stage.tables()
        return tables

    def as_dict(self) -> dict[str, Any]:
        """Return the `manifest`, `folding` and `images`."""
        peaks = {"folding": self.folding, "images": self.images}
        gains: dict[str, Any] = {
            key: {name: {"gain": gain, "at": at} for name, (gain, at) in found.items()} for key, found in peaks.items()
        }
        if self.passband is not None:
            gains["passband"] = dict(zip(("least", "most"), self.passband, strict=True))
        looked = {} if self.choice is None else {"structures": self.structures}
        return self.manifest | gains | looked

    @property
    def _first(self) -> Any:
        return self.core.stages[0].design

    def _computed(self, codes: Codes) -> Codes:
        block = codes[:, None, :] if codes.ndim == 2 else codes
        results = self.core.compute(block)
        return results[:, 0] if codes.ndim == 2 else results

    def _in_unit(self, value: float) -> Quantity:
        return Quantity(value, self.core.spec.base.output.unit)

    def __repr__(self) -> str:
        stages = " -> ".join(stage.spec.name for stage in self.core.stages)
        return f"<sosmith.Chain {self.name}: {stages}, error at most {self.bound}>"


def design_chain(
    specification: ChainSpecification | str | PathLike[str] | Mapping[str, Any],
    *,
    board: str | None = None,
    progress: Progress = lambda step, done, total: None,
) -> Chain:
    """Design a chain: the formats between stages and each stage by itself; and prove the end-to-end error.

    For a stage of the kind auto, the stages are chosen first: `Chain.structures` says among which, and
    `Chain.specification` has those that were chosen.

    Parameters
    ----------
    specification : ChainSpecification, path or mapping
        The specification; a path or a mapping is passed to `ChainSpecification.load`.
    board : str
        Name of the target board, as for `design`.
    progress : callable
        Called with the name of each step, 0 and 0.

    Raises
    ------
    SpecificationError
        If a stage breaks a rule, or there is no such board.
    ShortfallError
        If no word lengths meet the allowed error, or no stages the limits of the whole.
    """
    spec = specification if isinstance(specification, ChainSpecification) else ChainSpecification.load(specification)
    target = None if board is None else find_board(board)
    with falling_short(spec.checked.base.path):
        if spec.checked.is_automatic:
            choice = choose_stages(spec.checked, board=target, progress=lambda step: progress(step, 0, 0))
            return Chain(choice.design, choice)
        return Chain(design_stages(spec.checked, board=target, progress=lambda step: progress(step, 0, 0)))
