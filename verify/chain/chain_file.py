"""The file format of a chain's certificate: its stages' certificates by their digests, and what follows from them.

Numbers are written as in the certificate of a core. Errors and bounds are in the unit of the output, gains have none.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from sosmith.verify.certificate_file import (
    Entry,
    FileEntry,
    LongText,
    PortEntry,
    Rational,
    Sha256,
    Text,
    entries_text,
    read_entries,
)

_MARK = b'"format": "sosmith chain certificate '


def is_chain_certificate(content: bytes) -> bool:
    """Say whether the content of a certificate file is that of a chain, by its begin."""
    return _MARK in content[:100]


class ChainStageEntry(Entry):
    """A stage: the certificates of its cores, its own error, and how much of that reaches the end at most.

    A stage that interpolates has a core for each of the results of a sample, in their order; any other has one.
    """

    name: Text
    kind: Literal["polynomial", "gain", "iir", "fir", "halfband", "cic"]
    certificates: Annotated[tuple[FileEntry, ...], Field(min_length=1, max_length=64)]
    error: Rational
    gain: Rational


class LargestEntry(Entry):
    """A gain that nothing exceeds, and a frequency in units of the sample rate at which hardly less is reached."""

    gain: Rational
    at: Rational


class KeptEntry(Entry):
    """Gains of a chain that has limits: `least` and `most` in its pass band, and the largest from `stop` on.

    `least` is one below which none is, and where it is said to be reached, hardly more is. `stop` and `stopped` are
    None where only aliases into the pass band have a limit.
    """

    least: LargestEntry
    most: LargestEntry
    stop: Rational | None = None
    stopped: LargestEntry | None = None


class FoldingEntry(Entry):
    """What comes out of some stages at another frequency than it went in; none interpolates behind one that decimates.

    Together they interpolate by `rise`, then decimate by `factor`. Frequencies are in units of the rate between.
    `anywhere` bounds the gain of images and aliases, from half the lower one of both other rates on. `passing` bounds
    that of what comes in, or out, at a frequency up to `edge`; both are None without a pass band. `kept` is None in a
    chain without limits.
    """

    rise: Annotated[int, Field(strict=True, ge=1, le=1 << 20)]
    factor: Annotated[int, Field(strict=True, ge=1, le=1 << 20)]
    anywhere: LargestEntry
    edge: Rational | None = None
    passing: LargestEntry | None = None
    kept: KeptEntry | None = None


class LimitedEntry(FoldingEntry):
    """The same of the stages from `first` to `last` by themselves, of which limits are asked."""

    first: Annotated[int, Field(strict=True, ge=0, le=7)]
    last: Annotated[int, Field(strict=True, ge=0, le=7)]


class ChainCertificate(Entry):
    """The certificate of a chain.

    The exact result is that of the stages' exact calculations one behind the other, limited to the output's range once,
    at the end. `settling` is the number of results of a channel that are flagged after a start from zero: those until
    all stages have settled, one after the other; of a single stage of several cores, each core flags its own.
    `specification` is the whole text, TOML, and `files` are those of the whole: those of the stages stand in their own
    certificates. `certificate` is the SHA-256 of this file's own text with 64 zeros in this place. `limited` is None
    where limits are those of all stages, or there are none.
    """

    format: Literal["sosmith chain certificate 1"]
    name: Text
    specification: LongText
    inputs: Annotated[tuple[PortEntry, ...], Field(min_length=1, max_length=2)]
    output: PortEntry
    max_error: Rational
    channels: Annotated[int, Field(strict=True, ge=1, le=1 << 16)]
    stages: Annotated[tuple[ChainStageEntry, ...], Field(min_length=1, max_length=8)]
    bound: Rational
    settling: Annotated[int, Field(strict=True, ge=0, le=1 << 30)] = 0
    folding: Annotated[tuple[FoldingEntry, ...], Field(max_length=8)] = ()
    limited: LimitedEntry | None = None
    files: Annotated[tuple[FileEntry, ...], Field(max_length=32)] = ()
    certificate: Sha256


def sealed_chain(certificate: ChainCertificate) -> ChainCertificate:
    """Return a certificate with the SHA-256 of its own text."""
    blank = certificate.model_copy(update={"certificate": "0" * 64})
    digest = hashlib.sha256(entries_text(blank).encode()).hexdigest()
    return certificate.model_copy(update={"certificate": digest})


def read_chain(path: Path) -> ChainCertificate:
    """Read the certificate of a chain and check its form.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or is none.
    """
    return read_entries(path, ChainCertificate)
