"""Certificates of chains that were changed, with the digests of what is there."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import sosmith
from sosmith.verify.certificate_file import entries_text
from sosmith.verify.chain.chain_file import ChainCertificate, read_chain, sealed_chain

CERTIFICATE = "rx.certificate.json"


def sealed_again(folder: Path, change: Callable[[dict[str, Any]], None] = lambda tree: None) -> None:
    """Change claims, and give the certificate the digests of the files as they are, and its own."""
    tree = read_chain(folder / CERTIFICATE).model_dump(mode="json")
    change(tree)
    for entry in (*tree["files"], *(file for stage in tree["stages"] for file in stage["certificates"])):
        entry["sha256"] = hashlib.sha256((folder / entry["name"]).read_bytes()).hexdigest()
    certificate = sealed_chain(ChainCertificate.model_validate(tree))
    (folder / CERTIFICATE).write_text(entries_text(certificate), encoding="utf-8")


def changed(path: str, value: Callable[[Any], Any]) -> Callable[[dict[str, Any]], None]:
    """Return a change of one claim, by keys and indices with dots."""

    def change(tree: Any) -> None:
        *way, last = path.split(".")
        for key in way:
            tree = tree[int(key) if key.isdigit() else key]
        tree[last] = value(tree[last])

    return change


def less(text: str) -> str:
    """Return a rational that is 1 % less."""
    return str(Fraction(text) * Fraction(99, 100))


def more(text: str) -> str:
    """Return a rational that is 1 % more."""
    return str(Fraction(text) * Fraction(101, 100))


def replace_sealed(path: Path, old: str, new: str) -> None:
    """Put `new` in place of the first `old` in a file, and seal the certificate beside it again."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    sealed_again(path.parent)


def proven(folder: Path, *, spec: bool = True) -> sosmith.ChainProof:
    """Prove the chain in a folder with its files, and from its specification if `spec`."""
    return sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(
        files=folder, spec=folder / "rx.toml" if spec else None
    )
