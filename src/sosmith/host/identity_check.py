"""Holds a board's identity against the manifest and the certificate of a core."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sosmith.model.errors import ShortfallError, SpecificationError
from sosmith.model.foreign_files import MAX_JSON, read_bytes, read_json
from sosmith.model.link.identity import CONVERTER_FLAGS, Identity
from sosmith.verify.certificate_file import read_certificate
from sosmith.verify.chain.chain_file import is_chain_certificate, read_chain


def check_design(identity: Identity, verilog: str) -> None:
    """Check that the core in a board was made from this SystemVerilog.

    Raises
    ------
    ShortfallError
        If it was not.
    """
    _check(identity, "design", hashlib.sha256(verilog.encode()).hexdigest()[:12], identity.design[:12])


def check_files(identity: Identity, folder: Path) -> dict[str, Any]:
    """Check that a board has the core whose manifest and certificate are in `folder`; return the manifest.

    Raises
    ------
    ShortfallError
        If it has another one; says what differs.
    SpecificationError
        If the files cannot be read, or are not those of a core.
    """
    manifest = _manifest(folder / f"{identity.name}.json")
    name, files = _certified(folder / f"{identity.name}.certificate.json")
    source = f"{identity.name}.sv"
    if source not in files:
        raise SpecificationError(f"{folder}: the certificate must be one that lists {source}, not without it")
    _check(identity, "design", files[source][:12], identity.design[:12])
    _check(identity, "name", name, identity.name)
    added = CONVERTER_FLAGS if identity.source == "converter" else {}
    try:
        streams = manifest["streams"]
        facts: dict[str, tuple[Any, Any]] = {
            "core": (manifest["core"], identity.core),
            "channels": (manifest["channels"], identity.channels),
            "inputs": (_quantities(streams["s_axis"]), [list(quantity) for quantity in identity.inputs]),
            "output": (_quantities(streams["m_axis"]), [list(identity.output)]),
            "flags": (streams["m_axis"]["tuser"]["flags"] | added, identity.flags),
        }
    except (KeyError, TypeError) as error:
        raise SpecificationError(f"{folder}: the manifest must have its keys, not be without {error}") from None
    for key, (expected, actual) in facts.items():
        _check(identity, key, expected, actual)
    return manifest


def folder_of(identity: Identity, folder: Path) -> Path | None:
    """Return where the files of a board's core are: `folder`, or a folder in it, as `sosmith build` makes for a board.

    Returns
    -------
    Path or None
        The first folder with the files of this very design; None if there is none.

    Raises
    ------
    ShortfallError
        If there are files of a core of this name, but of other designs only.
    """
    name = f"{identity.name}.certificate.json"
    folders = [place.parent for place in (folder / name, *sorted(folder.glob(f"*/{name}"))) if place.exists()]
    for place in folders:
        _, files = _certified(place / name)
        if files.get(f"{identity.name}.sv") == identity.design:
            return place
    if folders:
        raise ShortfallError(
            f"one of the folders {', '.join(map(str, folders))} must have the files of the board's core, "
            f"{identity.name} with the design {identity.design[:12]}, not of other designs only: run `sosmith "
            "generate` on its specification with the options of the board, or name the folder with --files"
        )
    return None


def _certified(path: Path) -> tuple[str, dict[str, str]]:
    """Return the name of the core, or of the chain, of a certificate, and the digests of its files."""
    if is_chain_certificate(read_bytes(path, what="the certificate", max_bytes=MAX_JSON)):
        chain = read_chain(path)
        return chain.name, {file.name: file.sha256 for file in chain.files}
    certificate = read_certificate(path)
    files = () if certificate.about is None else certificate.about.files
    return certificate.name, {file.name: file.sha256 for file in files}


def _check(identity: Identity, key: str, expected: Any, actual: Any) -> None:
    if expected != actual:
        raise ShortfallError(f"the board's {key} must be {expected}, not {actual}; its core is {identity.name}")


def _manifest(path: Path) -> dict[str, Any]:
    tree = read_json(path, what="the manifest")
    if not isinstance(tree, Mapping):
        raise SpecificationError(f"{path}: the manifest must be JSON, an object, not something else")
    return dict(tree)


def _quantities(stream: Mapping[str, Any]) -> list[list[Any]]:
    keys = ("name", "width", "signed", "zero", "lsb", "unit")
    return [[field[key] for key in keys] for field in stream["fields"]]
