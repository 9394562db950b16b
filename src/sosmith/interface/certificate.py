"""The certificate of a design, and the result of its proof."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.facts.design_tables import budget_table
from sosmith.gen.facts.table import Table, View
from sosmith.gen.specification.specification import Specification, from_text, load
from sosmith.interface.quantity import Quantity
from sosmith.interface.second_reader import SECOND_READERS, read_again
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import MAX_JSON, read_bytes
from sosmith.model.text_files import write_files
from sosmith.verify.certificate_file import Certificate as Entries
from sosmith.verify.certificate_file import certificate_text, read_certificate
from sosmith.verify.multirate.cic import DecimatorVerdict
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.parallel.smt.obligations import obligations
from sosmith.verify.program.check import ProgramVerdict
from sosmith.verify.rocq.check import RocqVerdict, check_in_rocq, rocq_texts
from sosmith.verify.specified.stated_specification import Agreement
from sosmith.verify.verdict.door import Stated, judge
from sosmith.verify.verdict.generated_files import about_of, ascii_text, check_texts, content_of
from sosmith.verify.verdict.limits import SECONDS
from sosmith.verify.verdict.scope import Part, State

__all__ = [
    "Agreement",
    "Certificate",
    "DecimatorVerdict",
    "Entries",
    "HardwareVerdict",
    "Part",
    "ProgramVerdict",
    "Proof",
    "RocqVerdict",
    "State",
]

Progress = Callable[[str, int, int], None]
"""Called with the name of a step, the amount done and the total; both are 0 if they are not known."""


def _stated(spec: Specification, core: str | None) -> Stated:
    return Stated(spec.text, spec.path.parent, None if spec.calibration is None else spec.calibration.data, core)


def _check_second_reader(name: str | None, files: str | PathLike[str] | None) -> None:
    if name is None:
        return
    if name not in SECOND_READERS:
        raise SpecificationError(f"the second reader must be {' or '.join(SECOND_READERS)}, not {name}")
    if files is None:
        raise SpecificationError("the second reader must be given files to read")


@dataclass(frozen=True)
class Proof(View):
    """Result of proving a certificate.

    Attributes
    ----------
    bound : Quantity
        Bound on the difference between hardware and exact result, for all inputs in range.
    budget : dict of str to Quantity
        Parts of the bound, which add up to it.
    allowed, lsb : Quantity
        What the specification allows, and one LSB of the output.
    nodes : int
        Number of operations whose range was checked.
    ranges : int
        Number of these ranges that needed a worst-case peak gain.
    """

    bound: Quantity
    budget: dict[str, Quantity]
    allowed: Quantity
    lsb: Quantity
    nodes: int
    ranges: int
    agreement: Agreement | None = None
    """What of the specification was compared; None if it was not."""
    files: int = 0
    """Number of files whose content was compared."""
    program: ProgramVerdict | None = None
    """What the check of the program in the SystemVerilog found; None if it was not checked."""
    calibration: ProgramVerdict | HardwareVerdict | None = None
    """What the check of a calibration before a decimator found, by its architecture; None without one, or if it was not
    checked."""
    hardware: HardwareVerdict | None = None
    """What the check of a parallel core's SystemVerilog found; None if it was not checked."""
    decimator: DecimatorVerdict | None = None
    """What the check of a decimator's SystemVerilog found; None without one, or if it was not checked."""
    rebuilt: int = 0
    """Number of files that were generated again."""
    scope: Mapping[str, Part] = field(default_factory=dict)
    """How much of each part is proven: arithmetic, filter, calibration, manifest, hardware, program, unit, flags,
    liveness, c_model and rtlil, in this order, and second_reader if there was one."""

    @property
    def missing(self) -> dict[str, Part]:
        """The parts that were asked for and are not proven as a whole; empty if everything is."""
        return {name: part for name, part in self.scope.items() if part.is_missing}

    def tables(self) -> list[Table]:
        """Return what the bound is made of, and what is allowed."""
        return [budget_table(self.budget, self.allowed, self.lsb, self.bound.unit)]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
        agreement, distance = self.agreement, None if self.agreement is None else self.agreement.distance
        return {
            "proven": not self.missing,
            "scope": {
                name: {"state": part.state.value, "asked": part.asked, "why": part.why}
                for name, part in self.scope.items()
            },
            "error_bound": self.bound,
            "error_parts": self.budget,
            "error_unit": self.bound.unit,
            "max_error": self.allowed,
            "nodes": self.nodes,
            "ranges_from_peak_gains": self.ranges,
            "specification": None
            if agreement is None
            else {
                "core": agreement.core,
                "filter_distance": None if distance is None or agreement.by_losses else float(distance),
                "filter_by_losses": agreement.by_losses,
                "calibration_from_measurements": agreement.fitted,
                "not_compared": list(agreement.not_compared),
            },
            "files_compared": self.files,
            "program_instructions": None if self.program is None else self.program.instructions,
            **_size("calibration", self.calibration),
            "hardware_registers": None if self.hardware is None else self.hardware.registers,
            "decimator_registers": None if self.decimator is None else self.decimator.registers,
            "files_rebuilt": self.rebuilt,
        }


def _size(name: str, verdict: ProgramVerdict | HardwareVerdict | None) -> dict[str, int]:
    """Return what a proof is about: instructions or registers."""
    if verdict is None:
        return {}
    if isinstance(verdict, ProgramVerdict):
        return {f"{name}_instructions": verdict.instructions}
    return {f"{name}_registers": verdict.registers}


@dataclass(frozen=True)
class Certificate:
    """Every operation of a core, the exact filter that it approximates, and the claimed error bound.

    Examples
    --------
    >>> import sosmith
    >>> sos = [[0.25, 0.5, 0.25, 1.0, -0.5, 0.25]]
    >>> spec = sosmith.Specification.from_sos(sos, 1000, input_bits=8, realization="df1", architecture="parallel")
    >>> certificate = sosmith.design(spec).certificate
    >>> proof = certificate.verify()
    >>> proof.bound == certificate.bound <= spec.max_error
    True
    """

    entries: Entries = field(repr=False)
    """The content of the certificate, as in its file."""

    path: Path | None = field(default=None, repr=False)
    """Its file, if it was read from one."""

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Certificate:
        """Read a certificate file, such as ``<name>.certificate.json``.

        Raises
        ------
        SpecificationError
            If the file cannot be read, or is not a certificate.
        """
        source = Path(fspath(path))
        return cls(read_certificate(source), source)

    @property
    def name(self) -> str:
        """Name of the core."""
        return self.entries.name

    @property
    def bound(self) -> Quantity:
        """The claimed error bound, in the unit of the output."""
        output = self.entries.output
        return Quantity(float(self.entries.claims.bound * output.lsb), output.unit)

    def verify(
        self,
        progress: Progress = lambda step, done, total: None,
        *,
        spec: str | PathLike[str] | None = None,
        files: str | PathLike[str] | None = None,
        rebuild: bool = False,
        core: str | None = None,
        second_reader: str | None = None,
        seconds: float = SECONDS,
    ) -> Proof:
        """Prove the certificate by a different method than the one that made it, and hold it against its subject.

        Parameters
        ----------
        progress : callable
        spec : path
            Specification file to hold the certificate against: ports, allowed error and calibration must be the same,
            the ideal filter is derived again from its words, and its text must be the one in the certificate.
        files : path
            Folder with the generated files: their SHA-256 must be those in the certificate, and no byte of the
            certificate's own file may have been changed. From the SystemVerilog, the program of a folded or serial
            core with the unit that runs it, and all hardware of a parallel one, is proven to compute the certificate's
            graph for all inputs and states; online cores are not, nor cores with loadable constants or protection, nor
            the unit beside a decimator. A decimator, how it is wired
            to a calibration before it, and what holds results behind it, is proven register by register.
        rebuild : bool
            Whether to generate all files again, from `spec` or the specification's text in the certificate, and compare
            them byte for byte.
        core : str
            With `spec`, the core that must be proven: instrument, filter or calibration; all that the specification
            describes if it is not given.
        second_reader : str
            With `files`, "yosys": an outside front end reads the SystemVerilog as well, and every register, memory,
            port and instance must be the same, bit by bit, as what the proof reads.
        seconds : float
            Processor time that the proof may take, in s, where it runs in the main thread; 0 for any.

        Returns
        -------
        Proof
            What is proven. Nothing is wrong then, but parts may not be proven: its `missing` names those asked for.

        Raises
        ------
        ShortfallError
            If any claim does not follow exactly, or anything disagrees.
        SpecificationError
            If a file cannot be read, or the specification is invalid.
        ToolError
            If the second reader is missing.
        """
        _check_second_reader(second_reader, files)
        checked = None if spec is None else load(Path(fspath(spec)))
        judgement = judge(
            self.entries,
            progress,
            stated=None if checked is None else _stated(checked, core),
            folder=None if files is None else Path(fspath(files)),
            content=self.text().encode() if self.path is None else _content(self.path),
            seconds=seconds,
        )
        scope = dict(judgement.scope)
        if second_reader is not None and files is not None:
            progress("second reader", 0, 0)
            readings = read_again(judgement.files[f"{self.name}.sv"].decode("ascii"), self.name, seconds)
            why = (
                f"Yosys sees the same {readings.register_bits} bits of registers and {readings.words} words of "
                f"memories in {readings.modules} modules, and what each of them becomes"
            )
            scope["second_reader"] = Part(State.PROVEN, why)
        verdict, again = judgement.verdict, 0
        if rebuild:
            from sosmith.gen.output.rebuild import rebuilt

            about = about_of(self.entries)
            if checked is None:
                checked = from_text(about.specification, Path("specification"))
            again = check_texts(about, rebuilt(about, checked, lambda step: progress(step, 0, 0)))
        lsb, unit = self.entries.output.lsb, self.entries.output.unit
        return Proof(
            bound=Quantity(float(verdict.bound * lsb), unit),
            budget={part: Quantity(float(value * lsb), unit) for part, value in verdict.budget.items()},
            allowed=Quantity(float(self.entries.max_error), unit),
            lsb=Quantity(float(lsb), unit),
            nodes=verdict.nodes,
            ranges=verdict.ranges,
            agreement=judgement.agreement,
            files=len(judgement.files),
            program=judgement.proofs.program,
            calibration=judgement.proofs.calibration,
            hardware=judgement.proofs.hardware,
            decimator=judgement.decimator,
            rebuilt=again,
            scope=scope,
        )

    def check_in_rocq(
        self, progress: Progress = lambda step, done, total: None, *, seconds: float = 600.0
    ) -> RocqVerdict:
        """Have the kernel of the proof assistant Rocq check claims of the certificate.

        Parameters
        ----------
        progress : callable
        seconds : float
            Time that this may take, in s; 0 for any.

        Raises
        ------
        ShortfallError
            If a claim is not accepted, or not within the time.
        ToolError
            If `coqc` is missing or fails.
        """
        return check_in_rocq(self.entries, progress, seconds=seconds)

    def export_rocq(self, folder: str | PathLike[str]) -> list[Path]:
        """Write what Rocq checks into a folder, with a Makefile for a machine that has Rocq alone; return the paths.

        Of a wrong certificate, theorems that only a true one lets be written are missing, and Rocq refuses the file.

        Raises
        ------
        ShortfallError
            If there is nothing of the certificate that a theorem could be about.
        SpecificationError
            If a file cannot be written.
        ToolError
            If the disk is full.
        """
        return list(write_files(Path(fspath(folder)), rocq_texts(self.entries)))

    def export_smt(self, folder: str | PathLike[str], *, files: str | PathLike[str]) -> list[Path]:
        """Write the goals of the proof of a parallel core's hardware as SMT-LIB, one file for each register.

        Each is to be ``unsat`` in any solver of QF_BV; ``sat`` is a counterexample.

        Parameters
        ----------
        folder : path
            Where the files go.
        files : path
            Folder with the core's SystemVerilog, of one channel and one sample a clock.

        Raises
        ------
        ShortfallError
            If the hardware has anything that no goals are written for.
        SpecificationError
            If a file cannot be read or written.
        ToolError
            If the disk is full.
        """
        name = f"{self.name}.sv"
        goals = obligations(ascii_text(name, content_of(Path(fspath(files)) / name)), self.entries)
        return list(write_files(Path(fspath(folder)), {f"{register}.smt2": goal for register, goal in goals.items()}))

    def text(self) -> str:
        """Return the content of its file as JSON, identical on every run."""
        return certificate_text(self.entries)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write its file and return the path.

        Raises
        ------
        SpecificationError
            If the file cannot be written.
        ToolError
            If the disk is full.
        """
        target = Path(fspath(path))
        (written,) = write_files(target.parent, {target.name: self.text()})
        return written

    def __repr__(self) -> str:
        return f"<sosmith.Certificate {self.name}: error at most {self.bound}>"


def _content(path: Path) -> bytes:
    return read_bytes(path, what="the certificate", max_bytes=MAX_JSON)
