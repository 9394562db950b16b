"""Compiled files that are kept between runs in the user's cache folder, each found by what it was made from.

An entry is a folder named by a key, a digest of everything that went into it. It is made beside its final place and
renamed, so that a killed process leaves no half of it; the digests of its files are held against them at each use, and
a damaged entry is made again. The digests are keyed, and all belongs to the user alone, so that nobody else can slip in
a library, which would be loaded and run. Locks let one process at a time make, use or remove an entry.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import hmac
import json
import os
import secrets
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

from sosmith.model.errors import SpecificationError

LIMIT = 512 * 2**20
"""Bytes that all entries together may take; beyond, those that were not used for the longest time are removed."""

_DIGESTS = "digests.json"
_NEW = ".new"
_LOCKS = "locks"
_KEY = "key"
_KEY_BYTES = 32


def cache_folder() -> Path | None:
    """Return the folder for compiled files in the user's cache folder, None if there is none that can be written."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    try:
        folder = (Path(named) if Path(named).is_absolute() else Path.home() / ".cache") / "sosmith" / "verilator"
        (folder / _LOCKS).mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, or not writable
        return None
    return folder if os.access(folder, os.W_OK | os.X_OK) and os.access(folder / _LOCKS, os.W_OK | os.X_OK) else None


def key_of(*parts: object) -> str:
    """Digest of everything that an entry is made from; `parts` must be representable in JSON."""
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


class BuildCache:
    """Entries in one folder.

    Parameters
    ----------
    folder : Path
        The folder; made if it is missing.
    limit : int
        Bytes that all entries together may take.

    Raises
    ------
    SpecificationError
        By all methods, if the folder, its locks or its key belong to someone else.
    """

    def __init__(self, folder: Path, limit: int = LIMIT) -> None:
        self._folder, self._limit = folder, limit

    def has(self, kind: str, key: str) -> bool:
        """Whether there is an undamaged entry."""
        return _is_whole(self._place(kind, key), self._key())

    def has_any(self, kind: str) -> bool:
        """Whether there is an entry of a kind, damaged or not."""
        return any(place.suffix != _NEW for place in self._folder.glob(f"{kind}-*"))

    @contextlib.contextmanager
    def entry(self, kind: str, key: str, make: Callable[[Path], None]) -> Iterator[Path]:
        """Lock an entry, made if it is missing or damaged, and yield its folder; what is needed later is to be copied.

        Parameters
        ----------
        kind : str
            First word of the name of the folder. While an entry is locked, another may be asked for if its kind
            differs.
        key : str
            From `key_of`.
        make : callable
            Called with an empty folder, to put the files of the entry there.
        """
        place = self._place(kind, key)
        with self._locked(place) as locked:
            assert locked
            secret = self._key()
            if not _is_whole(place, secret):
                new = place.with_name(place.name + _NEW)
                for rest in (new, place):  # of a killed process, and damaged
                    shutil.rmtree(rest, ignore_errors=True)
                new.mkdir(mode=0o700)
                make(new)
                (new / _DIGESTS).write_text(json.dumps(_digests(new, secret)), encoding="utf-8")
                new.rename(place)
                self._shrink(place)
            os.utime(place)
            yield place

    def _make_private(self) -> None:
        """Make the folders if they are missing, and close them to all others."""
        (self._folder / _LOCKS).mkdir(parents=True, exist_ok=True, mode=0o700)
        for place in (self._folder, self._folder / _LOCKS):
            _check_owner(place, place.stat())
            if stat.S_IMODE(place.stat().st_mode) & 0o077:
                place.chmod(0o700)

    def _key(self) -> bytes:
        """Return what only this user knows: made anew, which ends all entries, if missing or once open to others."""
        self._make_private()
        path = self._folder / _LOCKS / _KEY
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            status = os.fstat(handle)
            _check_owner(path, status)
            secret = os.pread(handle, _KEY_BYTES + 1, 0)
            if len(secret) != _KEY_BYTES or stat.S_IMODE(status.st_mode) & 0o077:
                secret = secrets.token_bytes(_KEY_BYTES)
                os.fchmod(handle, 0o600)
                os.ftruncate(handle, 0)
                os.pwrite(handle, secret, 0)
            return secret
        finally:
            os.close(handle)

    def clear(self) -> int:
        """Remove all entries that no process is using; return the number of bytes."""
        return sum(self._remove(place) for place in self._entries())

    def _place(self, kind: str, key: str) -> Path:
        return self._folder / f"{kind}-{key}"

    def _entries(self) -> list[Path]:
        """All entries, whole or not, those first that were not used for the longest time."""
        used = {}
        for place in self._folder.iterdir():
            with contextlib.suppress(FileNotFoundError):  # removed meanwhile
                if place.name != _LOCKS:
                    used[place] = place.stat().st_mtime_ns
        return sorted(used, key=lambda place: used[place])

    def _shrink(self, kept: Path) -> None:
        entries = [place for place in self._entries() if place != kept]
        total = _size(kept) + sum(_size(place) for place in entries)
        for place in entries:
            if total > self._limit or place.name.endswith(_NEW):
                total -= self._remove(place)

    def _remove(self, place: Path) -> int:
        """Remove an entry unless a process is using it; return the number of bytes."""
        with self._locked(place.with_name(place.name.removesuffix(_NEW)), wait=False) as locked:
            if not locked:
                return 0
            size = _size(place)
            shutil.rmtree(place, ignore_errors=True)
            return size

    @contextlib.contextmanager
    def _locked(self, place: Path, *, wait: bool = True) -> Iterator[bool]:
        """Lock what may be at `place`; yield whether that could be done, which is sure with `wait`."""
        kind, _, key = place.name.rpartition("-")
        self._make_private()
        # A few entries share a lock: locks are never removed, which could not be done safely.
        handle = os.open(self._folder / _LOCKS / f"{kind}-{key[:2]}", os.O_RDWR | os.O_CREAT, 0o600)
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                yield False
            else:
                yield True
        finally:
            os.close(handle)


def _check_owner(place: Path, status: os.stat_result) -> None:
    if status.st_uid != os.geteuid():
        raise SpecificationError(
            f"{place} must belong to the user who runs this, not to user {status.st_uid}; "
            "set XDG_CACHE_HOME to a folder of your own"
        )


def _is_whole(place: Path, secret: bytes) -> bool:
    try:
        _check_owner(place, place.stat())
        recorded = json.loads((place / _DIGESTS).read_text(encoding="utf-8"))
        return bool(recorded == _digests(place, secret))
    except (OSError, ValueError):
        return False


def _digests(place: Path, secret: bytes) -> dict[str, str]:
    """Digest of each file of an entry, with its name and that of the entry: nothing can be put in another's place."""
    entry = place.name.removesuffix(_NEW)
    return {
        path.name: hmac.new(secret, f"{entry}/{path.name}\0".encode() + path.read_bytes(), hashlib.sha256).hexdigest()
        for path in sorted(place.iterdir())
        if path.name != _DIGESTS
    }


def _size(place: Path) -> int:
    try:
        return sum(path.stat().st_size for path in place.iterdir())
    except OSError:  # removed meanwhile
        return 0
