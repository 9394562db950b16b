"""The certificate of a chain, and the result of its proof."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from sosmith.gen.chain.reading import load_chain
from sosmith.gen.facts.design_tables import budget_table
from sosmith.gen.facts.table import Table, View
from sosmith.interface.certificate import Certificate, Part, Progress
from sosmith.interface.quantity import Quantity
from sosmith.model.errors import SpecificationError
from sosmith.model.foreign_files import MAX_JSON, read_bytes
from sosmith.model.text_files import write_files
from sosmith.verify.certificate_file import entries_text
from sosmith.verify.chain.chain_file import ChainCertificate as Entries
from sosmith.verify.chain.chain_file import is_chain_certificate, read_chain
from sosmith.verify.chain.check import judge_chain, read_cores
from sosmith.verify.rocq.chain import chain_texts, check_chain_in_rocq
from sosmith.verify.rocq.check import RocqVerdict
from sosmith.verify.verdict.limits import SECONDS


@dataclass(frozen=True)
class ChainProof(View):
    """Result of proving the certificate of a chain.

    Attributes
    ----------
    bound : Quantity
        Bound on the end-to-end difference between hardware and exact result, for all inputs in range.
    budget : dict of str to Quantity
        What each stage adds to it.
    allowed, lsb : Quantity
        What the specification allows, and one LSB of the output.
    files : int
        Number of files whose content was compared.
    scope : mapping of str to Part
        How much of each part is proven: chain, stages and top, and the parts of the stages' own proofs.
    """

    bound: Quantity
    budget: dict[str, Quantity]
    allowed: Quantity
    lsb: Quantity
    files: int
    scope: Mapping[str, Part] = field(default_factory=dict)

    @property
    def missing(self) -> dict[str, Part]:
        """The parts that were asked for and are not proven as a whole; empty if everything is."""
        return {name: part for name, part in self.scope.items() if part.is_missing}

    def tables(self) -> list[Table]:
        """Return what the bound is made of, and what is allowed."""
        return [budget_table(self.budget, self.allowed, self.lsb, self.bound.unit)]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it in JSON types."""
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
            "files_compared": self.files,
        }


@dataclass(frozen=True)
class ChainCertificate:
    """What a chain claims: its stages' certificates by their digests, and one end-to-end bound."""

    entries: Entries = field(repr=False)
    """The content of the certificate, as in its file."""

    path: Path | None = field(default=None, repr=False)
    """Its file, if it was read from one."""

    @classmethod
    def load(cls, path: str | PathLike[str]) -> ChainCertificate:
        """Read a chain's certificate file.

        Raises
        ------
        SpecificationError
            If the file cannot be read, or is none.
        """
        source = Path(fspath(path))
        return cls(read_chain(source), source)

    @property
    def name(self) -> str:
        """Name of the chain."""
        return self.entries.name

    @property
    def bound(self) -> Quantity:
        """The claimed error bound, in the unit of the output."""
        return Quantity(float(self.entries.bound), self.entries.output.unit)

    def text(self) -> str:
        """Return the content of its file as JSON, identical on every run."""
        return entries_text(self.entries)

    def verify(
        self,
        progress: Progress = lambda step, done, total: None,
        *,
        spec: str | PathLike[str] | None = None,
        files: str | PathLike[str] | None = None,
        seconds: float = SECONDS,
    ) -> ChainProof:
        """Prove the stages one by one and the chain, and hold both against a specification and files.

        Parameters
        ----------
        progress : callable
        spec : path
            Specification file of the chain: its words are those that the certificate was made from, each stage is what
            its table asks for, and filters are derived again from these.
        files : path
            Folder with the generated files. The stages' SystemVerilog is proven as that of single cores, and that of
            the top is read: it has instances of the cores and wires between their streams alone. Without it, the
            certificates of the stages are read from the folder of the certificate.
        seconds : float
            Processor time that the proof of each stage may take, in s; 0 for any.

        Raises
        ------
        ShortfallError
            If any claim does not follow, or anything disagrees.
        SpecificationError
            If a file cannot be read, or the certificate was not read from one.
        """
        if self.path is None and files is None:
            raise SpecificationError("the certificate of a chain must be read from a file, beside those of its stages")
        checked = None if spec is None else load_chain(Path(fspath(spec)))
        folder = Path(fspath(files)) if files is not None else (self.path or Path()).parent
        content = (
            self.text().encode()
            if self.path is None
            else read_bytes(self.path, what="the certificate", max_bytes=MAX_JSON)
        )
        judged = judge_chain(
            self.entries,
            progress,
            folder=folder,
            content=content,
            text=None if checked is None else checked.text,
            spec_folder=Path() if checked is None else checked.base.path.parent,
            with_files=files is not None,
            seconds=seconds,
        )
        output = self.entries.output
        return ChainProof(
            bound=Quantity(float(judged.bound), output.unit),
            budget={name: Quantity(float(value), output.unit) for name, value in judged.budget.items()},
            allowed=Quantity(float(self.entries.max_error), output.unit),
            lsb=Quantity(float(output.lsb), output.unit),
            files=judged.files,
            scope=judged.scope,
        )

    def check_in_rocq(
        self, progress: Progress = lambda step, done, total: None, *, seconds: float = 600.0
    ) -> RocqVerdict:
        """Have the kernel of the proof assistant Rocq check the claims of a chain of filters, which may decimate.

        Those are what it checks of each stage by itself, and that their errors add up to the bound of the chain.

        Parameters
        ----------
        progress : callable
        seconds : float
            Time that this may take, in s; 0 for any.

        Raises
        ------
        ShortfallError
            If a claim is not accepted, or not within the time.
        SpecificationError
            If it is a chain of another kind, or the certificate was not read from a file.
        ToolError
            If `coqc` is missing or fails.
        """
        return check_chain_in_rocq(self.entries, read_cores(self.entries, self._folder), progress, seconds=seconds)

    def export_rocq(self, folder: str | PathLike[str]) -> list[Path]:
        """Write what Rocq checks into a folder, with a Makefile for a machine that has Rocq alone; return the paths.

        Raises
        ------
        ShortfallError
            If a claim of a stage is so wrong that no theorem can be written of it.
        SpecificationError
            As for `check_in_rocq`, or if a file cannot be written.
        ToolError
            If the disk is full.
        """
        texts = chain_texts(self.entries, read_cores(self.entries, self._folder))
        return list(write_files(Path(fspath(folder)), texts))

    @property
    def _folder(self) -> Path:
        if self.path is None:
            raise SpecificationError("the certificate of a chain must be read from a file, beside those of its stages")
        return self.path.parent

    def __repr__(self) -> str:
        return f"<sosmith.ChainCertificate {self.name}: error at most {self.bound}>"


def certificate_in(path: str | PathLike[str]) -> Certificate | ChainCertificate:
    """Read a certificate file: that of a chain, or that of a core.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or is neither.
    """
    content = read_bytes(Path(fspath(path)), what="the certificate", max_bytes=MAX_JSON)
    return ChainCertificate.load(path) if is_chain_certificate(content) else Certificate.load(path)
