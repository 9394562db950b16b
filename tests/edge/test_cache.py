"""The cache of compiled files among other users, who may write what they are let: nothing of theirs is taken."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from pathlib import Path

import pytest

from sosmith.model.errors import SpecificationError
from sosmith.sim.build_cache import BuildCache


def made(folder: Path, key: str = "aa", text: str = "sound") -> str:
    """Return what the cache has for a key, made of `text` if it has none."""
    with BuildCache(folder).entry("model", key, lambda place: (place / "library").write_text(text) and None) as place:
        return (place / "library").read_text()


@pytest.mark.parametrize("mask", [0o000, 0o002, 0o022])
def test_all_is_the_users_alone_whatever_the_mask(tmp_path: Path, mask: int) -> None:
    before = os.umask(mask)
    try:
        made(tmp_path / "cache")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "cache").stat().st_mode) == 0o700
    assert stat.S_IMODE((tmp_path / "cache" / "locks" / "key").stat().st_mode) == 0o600


def test_a_library_with_digests_of_its_own_is_not_taken(tmp_path: Path) -> None:
    made(tmp_path)
    entry = tmp_path / "model-aa"
    (entry / "library").write_text("evil")
    (entry / "digests.json").write_text(json.dumps({"library": hashlib.sha256(b"evil").hexdigest()}))
    assert not BuildCache(tmp_path).has("model", "aa")
    assert made(tmp_path) == "sound"


def test_an_entry_in_the_place_of_another_is_not_taken(tmp_path: Path) -> None:
    made(tmp_path, "aa", "one")
    made(tmp_path, "bb", "two")
    for name in ("library", "digests.json"):
        (tmp_path / "model-aa" / name).write_bytes((tmp_path / "model-bb" / name).read_bytes())
    assert made(tmp_path, "aa", "one") == "one"


@pytest.mark.parametrize("mode", [0o644, 0o660, 0o606])
def test_what_was_made_with_a_key_that_others_could_read_is_made_again(tmp_path: Path, mode: int) -> None:
    assert made(tmp_path, text="old") == "old"
    (tmp_path / "locks" / "key").chmod(mode)
    assert made(tmp_path, text="new") == "new"
    assert made(tmp_path, text="newer") == "new"


def test_a_folder_open_to_others_is_closed(tmp_path: Path) -> None:
    made(tmp_path)
    tmp_path.chmod(0o777)
    made(tmp_path)
    assert stat.S_IMODE(tmp_path.stat().st_mode) == 0o700


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("name", [".", "locks", "locks/key"])
def test_what_belongs_to_another_user_is_refused(tmp_path: Path, name: str) -> None:
    made(tmp_path)
    os.chown(tmp_path / name, 12345, 12345)
    with pytest.raises(SpecificationError) as caught:
        made(tmp_path)
    expected = f"{tmp_path / name} must belong to the user who runs this, not to user 12345; "
    assert str(caught.value) == expected + "set XDG_CACHE_HOME to a folder of your own"


def test_a_link_is_no_key(tmp_path: Path) -> None:
    made(tmp_path)
    key = tmp_path / "locks" / "key"
    key.rename(tmp_path / "locks" / "other")
    key.symlink_to("other")
    with pytest.raises(OSError, match="symbolic links"):
        made(tmp_path)
