"""Bitstreams kept from one command to the next: to make one takes nearly all the time of a build.

They are found by a digest of all that the programs get, of the programs' versions, and of the sources that change the
netlist on its way. A program that failed has left nothing; a file that is not as it was written counts as none.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sosmith.gen.realizations.kept_files import digest_of_sources, folder_in_cache, keep, read_kept

LIMIT = 32
"""Files that are kept, each of one to two megabytes; beyond, the older half of them goes."""

_SOURCES = ("gen/fpga",)
"""What works on the netlist, from the folder that holds the rooms."""


@dataclass(frozen=True)
class Made:
    """What programs made of a design.

    Attributes
    ----------
    content : bytes
        The bitstream.
    report : dict
        What the placer reported, as JSON has it.
    log : str
        All that the programs said.
    """

    content: bytes
    report: dict[str, Any]
    log: str


def kept_or_made(
    files: Mapping[str, bytes], commands: Sequence[Sequence[str]], versions: Mapping[str, str], make: Callable[[], Made]
) -> Made:
    """Return what the same programs have made of the same files before, or make it and keep that.

    Parameters
    ----------
    files : dict of str to bytes
        What the programs read, by name.
    commands : sequence of sequence of str
        How they are called.
    versions : dict of str to str
        Version of each program.
    make : callable
        Calls them.
    """
    folder = cache_folder()
    if folder is None:
        return make()
    key = repr((sorted(files.items()), [*map(list, commands)], sorted(versions.items()), digest_of_sources(_SOURCES)))
    place = folder / f"{hashlib.sha256(key.encode()).hexdigest()}.json"
    tree = read_kept(place)
    if tree is not None:
        return Made(**{**tree[0], "content": base64.b64decode(tree[0]["content"])})
    made = make()
    keep(place, {**asdict(made), "content": base64.b64encode(made.content).decode()}, LIMIT)
    return made


def cache_folder() -> Path | None:
    """Return the folder of what is kept; None if there can be none."""
    return folder_in_cache("bitstreams")
