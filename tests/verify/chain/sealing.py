"""Certificates of chains that were changed, with the digests of what is there."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

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
