"""From a specification to a proven design, and its uses: compute, generate, prove, simulate."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign, design_core
from sosmith.gen.filter.response import complex_response
from sosmith.gen.fpga.boards import BUILDABLE, MODELLED, PROJECTS, RATE, find_board
from sosmith.gen.output.core_facts import CoreFacts, core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.quantity import number
from sosmith.interface.arrays import real_numbers
from sosmith.interface.drawing import Drawing
from sosmith.interface.inputs import codes_of, encoded, traces_of
from sosmith.interface.quantity import Quantity
from sosmith.interface.specification import Specification, specification_of
from sosmith.interface.tables.cost import Cost
from sosmith.interface.trace import Trace
from sosmith.model.errors import ShortfallError, SpecificationError, falling_short

if TYPE_CHECKING:
    from sosmith.gen.estimate.estimate import Estimate
    from sosmith.gen.facts.table import Table
    from sosmith.gen.output.decimation_facts import RateCosts
    from sosmith.host.board import Board
    from sosmith.instrument.uncertainty.instrument_budget import InstrumentBudget
    from sosmith.interface.build import Build
    from sosmith.interface.certificate import Certificate, Progress, Proof
    from sosmith.interface.reload import Reload
    from sosmith.interface.report import Report

Floats = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of the hardware.

    Attributes
    ----------
    integer : int
        Integer that the hardware multiplies by.
    fraction_bits : int
        Number of bits after the binary point: the value is ``integer / 2**fraction_bits``.
    """

    integer: int
    fraction_bits: int

    @property
    def value(self) -> float:
        """The real value of the coefficient."""
        return self.integer / 2.0**self.fraction_bits


@dataclass(frozen=True)
class Section:
    """A section of the filter, as implemented in hardware.

    Attributes
    ----------
    name : str
        Name, such as "section0".
    coefficients : dict of str to Coefficient
        The integer coefficients of its multiplications.
    b, a : tuple of float
        Numerator and denominator of its transfer function, with ``a[0] == 1``.
    formats : dict of str to str
        Q format of "input", "output" and every state.
    """

    name: str
    coefficients: dict[str, Coefficient]
    b: tuple[float, ...]
    a: tuple[float, ...]
    formats: dict[str, str]


@dataclass(frozen=True)
class Design:
    """A core with chosen word lengths and a proven error bound, as returned by `design`.

    Values are in physical units: inputs have the names and units of `Specification.inputs`, results the unit of the
    output. Arrays hold one sample per row, shape (samples,) for one channel and (samples, channels) for several.

    Examples
    --------
    >>> import numpy as np, sosmith
    >>> design = sosmith.design({
    ...     "name": "smooth",
    ...     "sample_rate": 1000,
    ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
    ...     "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0},
    ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
    ...     "hardware": {"realization": "df1_ef1"},
    ... })
    >>> x = np.sin(2 * np.pi * 50 * np.arange(200) / 1000)
    >>> y, exact = design.run(x=x), design.run_exact(x=x)
    >>> bool(abs(y - exact).max() <= design.bound)
    True
    >>> list(design.budget)
    ['filter coefficients', 'filter rounding', 'start', 'output rounding']
    >>> abs(design.frequency_response([0.0, 100.0])).round(3).tolist()
    [1.0, 0.707]
    >>> design.sos.shape, list(design.sections[0].coefficients)
    ((1, 6), ['A1', 'A2'])
    """

    core: CoreDesign = field(repr=False)
    """The design in the form of the inner packages: datapath, proof, architecture."""

    @property
    def specification(self) -> Specification:
        """The specification that was designed."""
        return Specification(self.core.spec)

    @property
    def name(self) -> str:
        """Name of the top module and of the files."""
        return self.core.datapath.name

    @property
    def kind(self) -> str:
        """What was designed: "instrument", "filter" or "calibration"."""
        return self.core.core

    @property
    def realization(self) -> str | None:
        """Structure of the filter sections; None without a filter."""
        return self.core.quantized.realization if self.core.quantized.sections else None

    @property
    def architecture(self) -> str:
        """How the hardware is organized: "parallel", "folded", "serial", "multiplexed" or "online"."""
        return self.core.architecture.name

    @property
    def reasons(self) -> dict[str, str]:
        """Why this realization and this architecture were chosen, one sentence each."""
        return dict(self.core.reasons)

    @cached_property
    def uncertainty(self) -> InstrumentBudget | None:
        """The uncertainty budget of a reading in the terms of the GUM; None if the calibration's is not known."""
        calibration = self.core.spec.calibration
        if calibration is None or not calibration.has_uncertainty:
            return None
        from sosmith.instrument.uncertainty.instrument_budget import budget_of  # and scipy.special, which is slow

        return budget_of(self.core)

    @property
    def latency_cycles(self) -> int:
        """Clock cycles from an input sample to its result."""
        return self.core.architecture.latency_cycles

    @property
    def cycles_per_sample(self) -> int:
        """Clock cycles from one input sample to the next, or from one beat of several to the next."""
        return self.core.architecture.cycles_per_sample

    @property
    def samples_per_clock(self) -> int:
        """Samples in each beat of the streams."""
        return self.core.architecture.samples_per_clock

    @cached_property
    def sos(self) -> Floats:
        """Ideal second-order sections, shape (sections, 6) as in scipy; no rows without a filter."""
        ideal = self.core.quantized.filter
        return np.zeros((0, 6)) if ideal is None else ideal.sos

    @cached_property
    def quantized_sos(self) -> Floats:
        """Second-order sections with the integer coefficients, shape (sections, 6); no rows without a filter."""
        return self.core.quantized.quantized_sos if self.core.quantized.sections else np.zeros((0, 6))

    @property
    def bound(self) -> Quantity:
        """Proven bound on ``|hardware - exact|`` for all inputs in range, the exact result limited as well.

        The bound in the certificate is computed more precisely; the two agree in all significant digits.
        """
        return self._in_units(self.core.quantized.bound)

    @property
    def budget(self) -> dict[str, Quantity]:
        """Parts of `bound`; they add up to it."""
        return {part: self._in_units(value) for part, value in self.core.quantized.budget.items()}

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The filter's sections, in the order of the cascade."""
        return tuple(
            Section(
                name=section.name,
                coefficients={c.name: Coefficient(c.integer, c.frac) for c in section.coefficients},
                b=section.b,
                a=section.a,
                formats={"input": section.input, **section.states, "output": section.output},
            )
            for section in self.facts.sections
        )

    @cached_property
    def rate_costs(self) -> dict[str, RateCosts]:
        """What the filter costs "decimated", and the same filter "direct", without a decimator; empty without one.

        The second is designed for the comparison, and missing if no formats meet the specification without a decimator.
        """
        from sosmith.gen.output.decimation_facts import direct_design, rate_costs

        if self.core.datapath.decimator is None:
            return {}
        costs = {"decimated": rate_costs(self.core)}
        with suppress(ShortfallError):
            costs["direct"] = rate_costs(direct_design(self.core))
        return costs

    @property
    def cost(self) -> Cost:
        """Operators before synthesis, for the parallel architecture: `multipliers`, `adder_bits`, `luts`, ..."""
        return Cost.of(self.facts.cost)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """What the core takes on FPGAs, estimated before synthesis; for the board of `design` alone if there is one.

        Without a board for one FPGA each of the families ECP5, iCE40 and Gowin; empty for a board with another one.
        Each has `board` and `device` by name, `luts` (LUT4, also as carry cells and memories), `flip_flops`,
        `multiplier_blocks`, `memory_bits`, `clocks` (lowest and highest of placed cores of the same architecture in
        MHz, and their number; None if there are too few), and `tested` (number of designs, and the relative error of
        `luts` that nine in ten of them do not exceed).
        """
        from sosmith.gen.estimate.estimate import usual_estimates

        board = self.core.options.get("board")
        return usual_estimates(self.core.architecture, None if board is None else find_board(board))

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """What software needs to know about the core: the content of ``<name>.json``."""
        return manifest(self.facts)

    @cached_property
    def certificate(self) -> Certificate:
        """The claims about the design, for an independent proof; the one that `generate` writes names its files too."""
        from sosmith.gen.output.certificate import about, certificate
        from sosmith.interface.certificate import Certificate

        core = self.core
        return Certificate(certificate(core.quantized, core.spec.max_error, about(core, {}), core.architecture.online))

    def verify(self, progress: Progress = lambda step, done, total: None) -> Proof:
        """Prove the certificate, as `Certificate.verify` does."""
        return self.certificate.verify(progress)

    def frequency_response(self, f: npt.ArrayLike, *, ideal: bool = False) -> npt.NDArray[np.complex128]:
        """Return the complex gain of the filter at the frequencies `f` in Hz, an array of the same shape.

        The default is the gain with the integer coefficients; with `ideal`, it is the gain without any rounding. With a
        decimator, it is the gain from a sine at the input to what it makes of it at the output, folded or not.

        Raises
        ------
        SpecificationError
            If the design has no filter, or a frequency is not a finite real number.
        """
        if not self.core.quantized.sections:
            raise SpecificationError("the design must have a filter for a frequency response, not only a calibration")
        frequencies = real_numbers(f, "frequencies")
        if not np.isfinite(frequencies).all():
            raise SpecificationError(f"frequencies must be finite, not {frequencies[~np.isfinite(frequencies)][0]}")
        sos, decimation = self.sos if ideal else self.quantized_sos, self.core.quantized.decimation
        if decimation is None:
            return complex_response(sos, frequencies, self.specification.sample_rate)
        return decimation.response(frequencies) * complex_response(sos, frequencies, float(decimation.rate))

    def run(self, **inputs: npt.ArrayLike) -> Floats:
        """Compute the output of the hardware for `inputs` bit for bit, starting from reset.

        Parameters
        ----------
        **inputs : array_like, shape (samples,) or (samples, channels)
            Physical values of each input, by its name. As in a converter, they are rounded to codes and limited to the
            range of the input. Shapes are broadcast: a number is a constant input, numbers alone are one sample.

        Returns
        -------
        ndarray of float, shape (samples,) or (samples, channels)
            The result, in the unit of the output.

        Raises
        ------
        SpecificationError
            If an input is missing, unknown, masked, complex or not finite, or the shapes do not fit.
        """
        return self.core.datapath.output.decode(self._computed(encoded(self.core, inputs)))

    def run_codes(self, **inputs: npt.ArrayLike) -> Codes:
        """Compute as `run` does, but from integer codes to integer codes.

        Raises
        ------
        SpecificationError
            As `run`, or if a code is not an integer or is outside the range of its input.
        """
        return self._computed(codes_of(self.core, inputs))

    def run_exact(self, **inputs: npt.ArrayLike) -> Floats:
        """Compute the exact result that `run` approximates: from the same input codes, in double precision.

        Parameters, result and errors are those of `run`.
        """
        codes = encoded(self.core, inputs)
        block = codes.reshape(len(codes), -1, codes.shape[-1])
        return self.core.quantized.exact(block).reshape(-1, *codes.shape[1:-1])

    @property
    def scenarios(self) -> dict[str, str]:
        """Descriptions of the built-in traces for this design, by their names; `trace` and `simulate` take them."""
        from sosmith.instrument.scenarios.summaries import SUMMARIES, fitting

        kind = "filter" if self.core.quantized.polynomial is None else "instrument"
        return {name: SUMMARIES[name].description for name in fitting(kind)}

    def trace(self, source: str | PathLike[str] | None = None, *, seconds: float | None = None, seed: int = 1) -> Trace:
        """Make the inputs of a built-in trace, or read those of a file.

        Parameters
        ----------
        source : str or path
            Name of a built-in trace, one of `scenarios`, or a CSV, WAV or scenario file. By default a trace that
            exercises most of the design.
        seconds : float
            Length of a built-in trace, in seconds of simulated time.
        seed : int
            Random seed for its noise.

        Raises
        ------
        SpecificationError
            If there is no such trace, or the file does not fit.

        Examples
        --------
        >>> import sosmith
        >>> design = sosmith.design({
        ...     "name": "smooth",
        ...     "sample_rate": 1000,
        ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
        ...     "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0},
        ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
        ... })
        >>> trace = design.trace("noise", seconds=0.5)
        >>> error = design.run(**trace.inputs) - design.run_exact(**trace.inputs)
        >>> len(trace.time), bool(abs(error).max() <= design.bound)
        (500, True)
        """
        return Trace.of(traces_of(self.core, source, seed=seed, seconds=seconds))

    def notes_on(self, source: str | PathLike[str]) -> tuple[str, ...]:
        """Return what there is to know about a trace by this name or file, one sentence each; most have nothing."""
        from sosmith.instrument.scenarios.traces import notes_on

        return notes_on(self.core, fspath(source))

    def board(self) -> Board:
        """Open a `Board` at whose other end is the integer model: for trying out, and for tests without hardware.

        Raises
        ------
        ToolError
            If no C compiler is found.

        Examples
        --------
        >>> import sosmith
        >>> design = sosmith.design({
        ...     "name": "smooth",
        ...     "sample_rate": 1000,
        ...     "input": {"x": {"bits": 12, "range": [-1.0, 1.0], "signed": True}},
        ...     "filter": {"family": "butterworth", "kind": "lowpass", "order": 2, "cutoff": 100.0},
        ...     "output": {"bits": 12, "range": [-1.0, 1.0], "signed": True},
        ... })
        >>> with design.board() as board:
        ...     results = board.run(x=[0.5] * 10)
        >>> bool((results.values == design.run(x=[0.5] * 10)).all())
        True
        """
        from sosmith.host.board import Board
        from sosmith.host.model_line import ModelLine, model_of

        return Board.on(ModelLine(model_of(self.core)))

    @overload
    def plot(self) -> Drawing: ...

    @overload
    def plot(self, path: str | PathLike[str]) -> Path: ...

    def plot(self, path: str | PathLike[str] | None = None) -> Path | Drawing:
        """Draw gain and group delay, specified and with integer coefficients, and the curves of the calibration.

        Parameters
        ----------
        path : path, optional
            File to write; its name ends in .svg or .png. Without one, a notebook shows the picture.

        Returns
        -------
        Path or Drawing
            Of the file; without one, the picture, whose ``svg`` is its text.

        Raises
        ------
        SpecificationError
            If the name ends in neither, or the folder cannot be written.
        """
        from sosmith.gen.picture import format_of
        from sosmith.gen.report.design_plot import design_plot
        from sosmith.model.text_files import write_contents

        if path is None:
            return Drawing(design_plot(self.core.quantized, "svg").decode("utf-8"))
        place = Path(fspath(path))
        content = design_plot(self.core.quantized, format_of(place))
        return write_contents(place.parent, {place.name: content})[0]

    def generate(self, folder: str | PathLike[str], progress: Progress = lambda step, done, total: None) -> list[Path]:
        """Write SystemVerilog, RTLIL, manifest, certificate and C model into `folder`; return their paths.

        Raises
        ------
        SpecificationError
            If the folder cannot be written.
        ToolError
            If Yosys fails, or the disk is full.
        """
        from sosmith.gen.output.generate import generate  # Amaranth is slow to import

        return generate(
            self.core,
            Path(fspath(folder)),
            lambda step: progress(step, 0, 0),
            facts=self.facts,
            claims=self.certificate.entries,
        )

    def reload(
        self,
        other: Specification | str | PathLike[str] | Mapping[str, Any],
        *,
        active: Specification | str | PathLike[str] | Mapping[str, Any] | None = None,
        reset: bool = False,
        version: int = 1,
        progress: Progress = lambda step, done, total: None,
    ) -> Reload:
        """Prove that the running core can load the coefficients of another specification.

        Parameters
        ----------
        other : Specification, path or mapping
            Another calibration, filter or allowed error, and otherwise the same.
        active : Specification, path or mapping
            What is active before the swap; by default what the core was generated with.
        reset : bool
            Whether the core is reset between the swap and the next sample: there is no transient, and more sets fit.
        version : int
            Value of the register VERSION once the new set is active, 0 to 2**32 - 1.
        progress : callable
            Called with the name of each step, 0 and 0.

        Raises
        ------
        SpecificationError
            If the core cannot reload, or `other` differs in more.
        ShortfallError
            If the set does not fit, or something could overflow during the swap.
        """
        from sosmith.interface.reload import Reload

        running = None if active is None else specification_of(active)
        return Reload.proven(
            self.core, specification_of(other), running, reset=reset, version=version, progress=progress
        )

    def package(
        self,
        folder: str | PathLike[str],
        *,
        vlnv: str | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> list[Path]:
        """Write the core and what other tools need to take it in into `folder`; return the paths of the files.

        Parameters
        ----------
        folder : path
            Folder of the package; its README.md says what the files are for.
        vlnv : str
            Name for FuseSoC and IP-XACT, "vendor:library:name:version"; "user:sosmith:<name>:1.0" by default.
        progress : callable
            Called with the name of each step, 0 and 0.

        Raises
        ------
        SpecificationError
            If the folder cannot be written, or `vlnv` is not of that form.
        ToolError
            If Yosys fails, or the disk is full.
        """
        from sosmith.gen.output.packages.package import package
        from sosmith.gen.output.packages.vlnv import Vlnv

        named = None if vlnv is None else Vlnv.read(vlnv)
        return package(self.core, Path(fspath(folder)), lambda step: progress(step, 0, 0), vlnv=named)

    def build(
        self,
        board: str,
        *,
        folder: str | PathLike[str] | None = None,
        rate: int = RATE,
        progress: Progress = lambda step, done, total: None,
    ) -> Build:
        """Make a bitstream for a board, with the core behind the serial link; takes some tens of seconds.

        Parameters
        ----------
        board : str
            Name of the board.
        folder : path
            Folder for the files, ``build/<name>/<board>`` by default.
        rate : int
            Rate of the serial line in baud, at most a fourth of the board's clock.
        progress : callable
            Called with the name of each step, 0 and 0.

        Returns
        -------
        Build
            Utilisation and timing; bitstream, log and ``build.json`` are in `folder`.

        Raises
        ------
        SpecificationError
            If there is no such board, the line rate is too high, or the folder cannot be written.
        ShortfallError
            If the design does not fit the FPGA.
        ToolError
            If a tool is missing or fails, or the disk is full.
        """
        from sosmith.gen.output.board_build import build_board
        from sosmith.interface.build import Build

        target = find_board(board, BUILDABLE)
        place = Path("build") / self.core.spec.name / target.name if folder is None else Path(fspath(folder))
        built = build_board(self.core, target, rate=rate, progress=lambda step: progress(step, 0, 0))
        return Build.written(built, place)

    def project(
        self,
        board: str,
        *,
        folder: str | PathLike[str] | None = None,
        rate: int = RATE,
        progress: Progress = lambda step, done, total: None,
    ) -> dict[str, Any]:
        """Write a project for the vendor's tools of a board, with the core behind the serial link; none of them is run.

        Parameters
        ----------
        board : str
            Name of the board: ``"arty_a7"`` or ``"cmod_s7"``.
        folder : path
            Folder for the files, ``build/<name>/<board>`` by default.
        rate : int
            Rate of the serial line in baud, at most a fourth of the board's clock.
        progress : callable
            Called with the name of each step, 0 and 0.

        Returns
        -------
        dict
            The content of ``build.json``, whose ``project`` names the files and the command that makes a bitstream of
            them; ``bitstream`` is None.

        Raises
        ------
        SpecificationError
            If there is no such board, the line rate is too high, or the folder cannot be written.
        ToolError
            If amaranth-boards is missing, or the disk is full.
        """
        from sosmith.gen.output.board_project import board_project

        target = find_board(board, PROJECTS)
        place = Path("build") / self.core.spec.name / target.name if folder is None else Path(fspath(folder))
        project = board_project(self.core, target, rate=rate, progress=lambda step: progress(step, 0, 0))
        project.write(place)
        return project.summary

    def cost_on(self, board: str, progress: Progress = lambda step, done, total: None) -> dict[str, Any]:
        """Return what the design takes of a board's FPGA, with the serial link: the content of ``build.json``.

        It is built for the board as `build` does, and the result is kept in the user's cache folder.

        Raises
        ------
        SpecificationError, ShortfallError, ToolError
            As `build`.
        """
        from sosmith.gen.output.board_build import board_cost
        from sosmith.sim.build_cache import cache_folder

        target, cache = find_board(board, BUILDABLE), cache_folder()
        place = None if cache is None else cache.parent / "boards"
        return board_cost(self.core, target, place, lambda step: progress(step, 0, 0))

    def silicon(self, library: str = "osu018", progress: Progress = lambda step, done, total: None) -> dict[str, Any]:
        """Return what the core takes of silicon in standard cells, before layout: wires take no area and no time.

        Memories are made of flip-flops. Products by constants take less as sums: `hardware.multipliers = 0`.

        Parameters
        ----------
        library : str
            Standard cells: ``"osu018"`` or ``"osu035"``.
        progress : callable
            Called with the name of each step, and two numbers that are 0.

        Returns
        -------
        dict
            `library`, `title` and `corner`; `area_um2`, of it `area_of_registers_um2`; `nand2_equivalents`; `cells`
            by kind; `clock_hz`, the highest clock, None without OpenSTA; `stage` and the version of `yosys`.

        Raises
        ------
        SpecificationError
            If there is no such library.
        ToolError
            If a program or the Debian package of the library is missing, or a program fails.
        """
        from sosmith.gen.estimate.silicon.libraries import find_library
        from sosmith.gen.estimate.silicon.synthesis import mapped
        from sosmith.gen.output.verilog import core_verilog

        cells = find_library(library)
        progress("SystemVerilog", 0, 0)
        verilog = core_verilog(self.core)
        progress(f"synthesis for {cells.name}", 0, 0)
        spec = self.core.spec
        return mapped(verilog, spec.name, cells, spec.hardware.clock).as_dict()

    def simulate(
        self,
        trace: str | PathLike[str] | Mapping[str, npt.ArrayLike] | None = None,
        *,
        folder: str | PathLike[str] | None = None,
        seconds: float | None = None,
        simulator: str = "verilator",
        gates: str | None = None,
        port: str | None = None,
        baud: int = 1_000_000,
        idle: float = 0.3,
        stall: float = 0.3,
        waves: bool = False,
        vectors: str | PathLike[str] | None = None,
        seed: int = 1,
        date: str | None = None,
        progress: Progress = lambda step, done, total: None,
    ) -> Report:
        """Simulate the generated hardware, and compare every sample with the integer model and the exact result.

        Parameters
        ----------
        trace : str, path or mapping of arrays
            Stimulus of the inputs: the name of a built-in trace (`sosmith emulate SPEC` lists them), a CSV, WAV or
            scenario file, or arrays as `run` takes them. By default a trace that exercises most of the core. If several
            channels get the same trace, each lags the previous one by a sample.
        folder : path
            Folder for the files, ``build/<name>`` by default.
        seconds : float
            Length of a built-in trace, in seconds of simulated time.
        simulator : str
            "verilator", "icarus" or "cxxrtl".
        gates : str
            Name of a board: simulate the netlist that Yosys synthesizes for its FPGA instead of the SystemVerilog.
        port : str
            Serial port of a board, real or virtual, that runs the core instead of a simulator.
        baud : int
            Bits per second on that port.
        idle, stall : float
            Fractions of clocks without an input sample and with the output stalled, 0 to 0.99.
        waves : bool
            Whether to write a waveform (VCD) as well.
        vectors : path
            File for the input and output codes of all samples: .csv, .npz, .vcd, or .hex for ``$readmemh``; .wav for
            the output codes alone, as sound.
        seed : int
            Random seed for noise and handshakes.
        date : str
            Date of the run as ``YYYY-MM-DD``, for the report; without it the report has none, and two runs write the
            same report but for the speed.

        Returns
        -------
        Report
            Verdict, results and samples; ``report.json`` and ``report.html`` are in `folder`.

        Raises
        ------
        SpecificationError
            If the trace, simulator, board or format of vectors does not exist, or the folder cannot be written.
        ShortfallError
            If the hardware breaks the stream protocol, or the board has another core.
        ToolError
            If a tool is missing or fails, or the disk is full.
        LinkError
            If the board does not answer.
        """
        # The simulation modules are slow to import; a design that only computes does not need them.
        from sosmith.gen.output.vectors import check_format, result_rate
        from sosmith.interface.report import Report
        from sosmith.sim.simulation import simulate
        from sosmith.sim.simulators import check_name

        check_name(simulator, netlist=gates is not None)
        for name, share in (("idle", idle), ("stall", stall)):
            if not 0 <= share <= 0.99:
                raise SpecificationError(f"{name} must be from 0 to 0.99, not {share}")
        if vectors is not None:
            check_format(Path(fspath(vectors)), result_rate(self.facts.interface, self.core.spec.sample_rate))
        if date is not None:
            from sosmith.instrument.calibration.store.measurement_files import parse_date  # and what reads workbooks

            parse_date(date)
        board = None if gates is None else find_board(gates, MODELLED)
        place = Path("build") / self.core.spec.name if folder is None else Path(fspath(folder))
        progress("trace", 0, 0)
        traces = traces_of(self.core, trace, seed=seed, seconds=seconds)
        with ExitStack() as stack:
            hardware = None
            if port is not None:
                from sosmith.host.board import Board
                from sosmith.host.port_run import run_on

                hardware = partial(run_on, stack.enter_context(Board(port, baud=baud)))
            evidence = simulate(
                self.core,
                traces,
                place,
                simulator=simulator,
                seed=seed,
                idle=idle,
                stall=stall,
                waves=waves,
                gates=board,
                hardware=hardware,
                vectors=None if vectors is None else Path(fspath(vectors)),
                date=date,
                uncertainty=self._uncertainty_json(),
                facts=self.facts,
                claims=self.certificate.entries,
                progress=progress,
            )
        progress("writing the report", 0, 0)
        return Report.written(self.core, evidence, place)

    @cached_property
    def facts(self) -> CoreFacts:
        """All facts about the core in manifest and report."""
        return core_facts(self.core)

    def _in_units(self, steps: Any) -> Quantity:
        """Convert LSBs of the output to its unit."""
        output = self.core.datapath.output
        return Quantity(float(steps * output.lsb), output.unit)

    def _computed(self, codes: Codes) -> Codes:
        return self.core.datapath.compute(codes)

    def tables(self, *, details: bool = False) -> list[Table]:
        """Return what `sosmith design` shows: the overview, what the error bound is made of, and the estimated cost.

        With `details`, also the uncertainty of a reading, the sections, their limit cycles and the schedule.
        """
        from sosmith.interface.tables.design import design_tables

        return design_tables(
            self.core,
            self.facts,
            budget=self.budget,
            rate_costs=self.rate_costs,
            estimates=self.estimates,
            uncertainty=self.uncertainty,
            details=details,
        )

    def _uncertainty_json(self) -> dict[str, Any] | None:
        if self.uncertainty is None:
            return None
        from sosmith.instrument.uncertainty.instrument_budget import budget_json

        return budget_json(self.uncertainty)

    def as_dict(self) -> dict[str, Any]:
        """Return the `manifest`, ``uncertainty`` (None if unknown), `estimates`, with a decimator ``rate_costs``."""
        beside = {name: asdict(costs) for name, costs in self.rate_costs.items()}
        tree = {"uncertainty": self._uncertainty_json(), "estimates": [each.as_dict() for each in self.estimates]}
        return self.manifest | tree | ({"rate_costs": beside} if beside else {})

    def _repr_html_(self) -> str:
        overview, budget, *_ = self.tables()
        inputs = ", ".join(f"{name} ({unit})" if unit else name for name, unit in self.specification.inputs.items())
        clocks = ("clocks a sample", number(self.core.architecture.clocks_per_sample))
        overview = replace(overview, rows=[("inputs", inputs), *overview.rows, clocks])
        return overview.html() + budget.html()

    def __repr__(self) -> str:
        structure = ", ".join(filter(None, (self.realization, self.architecture)))
        return f"<sosmith.Design {self.name}: {structure}, error at most {self.bound}>"


def design(
    specification: Specification | str | PathLike[str] | Mapping[str, Any],
    *,
    core: str | None = None,
    realization: str | None = None,
    widths_of: str | None = None,
    board: str | None = None,
    progress: Progress = lambda step, done, total: None,
) -> Design:
    """Design a core: choose realization, architecture and word lengths, and prove the error.

    Parameters
    ----------
    specification : Specification, path or mapping
        The specification; a path or a mapping is passed to `Specification.load`.
    core : str
        The part to design, "instrument", "filter" or "calibration"; by default everything in the specification.
    realization : str
        Structure of the sections; overrides the specification.
    widths_of : str
        Use the word lengths chosen for this realization, to compare structures at equal widths. The error can then
        exceed `max_error`.
    board : str
        Name of the target board; an automatic choice of the architecture considers its multipliers.
    progress : callable
        Called with the name of each step, 0 and 0.

    Raises
    ------
    SpecificationError
        If the core, realization or board does not exist, or the specification is invalid.
    ShortfallError
        If no word lengths meet the allowed error.

    Examples
    --------
    >>> import sosmith
    >>> sos = [[0.25, 0.5, 0.25, 1.0, -0.5, 0.25]]
    >>> spec = sosmith.Specification.from_sos(sos, 1000, input_bits=8, architecture="parallel")
    >>> sosmith.design(spec, realization="df1")
    <sosmith.Design sos_filter: df1, parallel, error at most 0.00...>
    >>> sosmith.design(spec, realization="df3")
    Traceback (most recent call last):
    ...
    sosmith.model.errors.SpecificationError: the realization must be auto, df1, ..., not df3 (did you mean df1?)
    """
    target = None if board is None else find_board(board)
    spec = specification_of(specification).checked
    with falling_short(spec.path):
        core_design = design_core(
            spec,
            core=core,
            realization=realization,
            widths_of=widths_of,
            board=target,
            progress=lambda step: progress(step, 0, 0),
        )
    return Design(core_design)
