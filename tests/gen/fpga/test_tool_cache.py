"""The programs that compile themselves run where the user's cache folder cannot be written, too."""

import os
import sys
from pathlib import Path

import pytest
import wasmtime

from sosmith.gen.fpga.tool_cache import tool_cache
from sosmith.gen.fpga.tools import Tool
from sosmith.gen.output import amaranth_yosys


def test_the_users_cache_is_used_where_it_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert tool_cache() == {}
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert tool_cache() == {}
    assert (tmp_path / ".cache").is_dir()


@pytest.mark.parametrize("home", ["", "relative", "plain.toml/../x"])
def test_a_home_that_is_no_absolute_path_is_replaced(
    home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("HOME", home)
    found = tool_cache()
    assert set(found) == {"HOME"}
    assert Path(found["HOME"]).is_dir()


@pytest.mark.parametrize("name", ["XDG_CACHE_HOME", "HOME"])
def test_else_a_folder_of_this_process(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv(name, str(tmp_path / "file"))
    made = Path(tool_cache()["XDG_CACHE_HOME"])
    assert made.is_dir()
    found: list[tuple[str, str]] = []

    class Config:
        def __setattr__(self, key: str, value: object) -> None:
            found.append((key, os.environ["XDG_CACHE_HOME"]))
            raise KeyError(key)

    before = dict(os.environ)
    monkeypatch.setattr(wasmtime, "Config", Config)
    with pytest.raises(KeyError):
        amaranth_yosys._program.__wrapped__()
    assert found == [("cache", str(made))]
    assert dict(os.environ) == before
    log, show = tmp_path / "log.txt", "import os; print(os.environ['XDG_CACHE_HOME'])"
    assert Tool("python", Path(sys.executable), "3").run(["-c", show], tmp_path, log) == 0
    assert log.read_text(encoding="utf-8").splitlines()[-1] == str(made)
