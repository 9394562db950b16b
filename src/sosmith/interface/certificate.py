"""The certificate of a design, and the result of its proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path

from sosmith.gen.verifier.certificate_file import Certificate as Entries
from sosmith.gen.verifier.certificate_file import certificate_text, read_certificate
from sosmith.gen.verifier.verification import verify
from sosmith.interface.quantity import Quantity
from sosmith.model.text_files import write_files

Progress = Callable[[str, int, int], None]
"""Called with the name of a step, the amount done and the total; both are 0 if they are not known."""


@dataclass(frozen=True)
class Proof:
    """Result of proving a certificate.

    Attributes
    ----------
    bound : Quantity
        Bound on the difference between hardware and exact result, for all inputs in range.
    budget : dict of str to Quantity
        Parts of the bound, which add up to it.
    nodes : int
        Number of operations whose range was checked.
    ranges : int
        Number of these ranges that needed a worst-case peak gain.
    """

    bound: Quantity
    budget: dict[str, Quantity]
    nodes: int
    ranges: int


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

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Certificate:
        """Read a certificate file, such as ``<name>.certificate.json``.

        Raises
        ------
        SpecificationError
            If the file cannot be read, or is not a certificate.
        """
        return cls(read_certificate(Path(fspath(path))))

    @property
    def name(self) -> str:
        """Name of the core."""
        return self.entries.name

    @property
    def bound(self) -> Quantity:
        """The claimed error bound, in the unit of the output."""
        output = self.entries.output
        return Quantity(float(self.entries.claims.bound * output.lsb), output.unit)

    def verify(self, progress: Progress = lambda step, done, total: None) -> Proof:
        """Prove the certificate from its content alone, by a different method than the one that made it.

        Raises
        ------
        ShortfallError
            If any claim does not follow exactly.
        """
        verdict = verify(self.entries, progress)
        lsb, unit = self.entries.output.lsb, self.entries.output.unit
        return Proof(
            bound=Quantity(float(verdict.bound * lsb), unit),
            budget={part: Quantity(float(value * lsb), unit) for part, value in verdict.budget.items()},
            nodes=verdict.nodes,
            ranges=verdict.ranges,
        )

    def text(self) -> str:
        """Return the content of its file as JSON, identical on every run."""
        return certificate_text(self.entries)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write its file and return the path.

        Raises
        ------
        SpecificationError
            If the file cannot be written.
        """
        target = Path(fspath(path))
        (written,) = write_files(target.parent, {target.name: self.text()})
        return written

    def __repr__(self) -> str:
        return f"<sosmith.Certificate {self.name}: error at most {self.bound}>"
