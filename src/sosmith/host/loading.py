"""Loads a proven set of coefficients into a board, and reads back what became active."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Protocol

from sosmith.model.errors import LinkError, RefusedError, ShortfallError, SpecificationError
from sosmith.model.foreign_files import read_json
from sosmith.model.reload.registers import CRC, DESIGN, ID, LAYOUT, LOCKING_STATUS, MAGIC, STATUS, VERSION, Outcome

LOCKED = LOCKING_STATUS.field("LOCKED")

PATIENCE = 2.0
"""Seconds to wait for the gap between two samples in which a set becomes active."""


@dataclass(frozen=True)
class Loaded:
    """What the registers of a board read after a load: the proof of what is active.

    Attributes
    ----------
    version : int
        Version of the active set.
    crc : int
        CRC-32 of its version and words, as proven.
    design : int
        Fingerprint of the core that it was made for.
    words : int
        Number of words.
    """

    version: int
    crc: int
    design: int
    words: int


class Registers(Protocol):
    """What a set is loaded through: the registers of a board."""

    def read_register(self, address: int) -> int:
        """Return the word at a byte address."""

    def write_register(self, address: int, *words: int) -> None:
        """Write words to the same byte address, one after another."""


def read_set(source: str | PathLike[str] | Mapping[str, Any]) -> Mapping[str, Any]:
    """Read what `sosmith reload` has written.

    Raises
    ------
    SpecificationError
        If the file cannot be read, or is something else.
    """
    if isinstance(source, Mapping):
        return source
    path = Path(fspath(source))
    tree = read_json(path, what="the set")
    if not isinstance(tree, dict) or not {"design", "version", "words", "writes"} <= tree.keys():
        raise SpecificationError(f"{path}: the set must be a file that `sosmith reload` has written, not another one")
    return tree


def load(board: Registers, proven: Mapping[str, Any]) -> Loaded:
    """Load a set that `sosmith reload` has proven; parameters and errors as for `Board.load`."""
    _match("ID", MAGIC, board.read_register(ID.address))
    _match("DESIGN", proven["design"], board.read_register(DESIGN.address))
    _require_open(board)
    layout = board.read_register(LAYOUT.address)
    _match("LAYOUT.WORDS", proven["words"], LAYOUT.field("WORDS").of(layout))
    writes: list[tuple[int, int]] = [(address, word) for address, word in proven["writes"]]
    try:
        for address, group in groupby(writes, key=lambda pair: pair[0]):
            board.write_register(address, *(word for _, word in group))
    except RefusedError as error:
        outcome = Outcome(STATUS.field("OUTCOME").of(board.read_register(STATUS.address)))
        raise RefusedError(f"{error}; the load ended as {outcome.name}, and the former set is active") from None
    deadline = time.monotonic() + PATIENCE
    while STATUS.field("PENDING").of(status := board.read_register(STATUS.address)):
        if time.monotonic() > deadline:
            raise LinkError(f"the set must become active within {PATIENCE:g} s, not still be pending")
    _match("STATUS.OUTCOME", Outcome.ACCEPTED, STATUS.field("OUTCOME").of(status))
    loaded = Loaded(
        version=board.read_register(VERSION.address),
        crc=board.read_register(CRC.address),
        design=proven["design"],
        words=proven["words"],
    )
    _match("VERSION", proven["version"], loaded.version)
    _match("CRC", writes[-1][1], loaded.crc)
    return loaded


def check_active(board: Registers, proven: Mapping[str, Any] | None) -> None:
    """Check that a set is the active one, or with None that the core runs with its own, which it was generated with.

    Raises
    ------
    ShortfallError
        If another set is active, or the last load failed, so that its registers do not tell.
    """
    outcome = Outcome(STATUS.field("OUTCOME").of(board.read_register(STATUS.address)))
    if proven is None:
        if outcome is not Outcome.NONE:
            version = board.read_register(VERSION.address)
            raise ShortfallError(f"the set that is active on the board, version {version}, must be named")
        return
    if outcome is not Outcome.ACCEPTED:
        raise ShortfallError(f"the board's last load must have ended as ACCEPTED, not as {outcome.name}: load the set")
    _match("DESIGN", proven["design"], board.read_register(DESIGN.address))
    _match("VERSION", proven["version"], board.read_register(VERSION.address))
    _match("CRC", proven["writes"][-1][1], board.read_register(CRC.address))


def lock(board: Registers) -> None:
    """Lock a board; parameters and errors as for `Board.lock`."""
    _match("ID", MAGIC, board.read_register(ID.address))
    board.write_register(STATUS.address, 1)
    _match("STATUS.LOCKED", 1, LOCKED.of(board.read_register(STATUS.address)))


def _require_open(board: Registers) -> None:
    if LOCKED.of(board.read_register(STATUS.address)):
        raise RefusedError("the board must be reset before a set can be loaded, for it is locked")


def _match(register: str, expected: int, actual: int) -> None:
    if expected != actual:
        raise ShortfallError(f"the board's register {register} must read {expected:#x}, not {actual:#x}")
