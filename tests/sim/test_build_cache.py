"""The cache of compiled files: made once, whole after a kill, mended when damaged, bounded, safe side by side."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.sim.stand_in import SOUND, write

from sosmith.sim.build_cache import LIMIT, BuildCache, cache_folder, key_of
from sosmith.sim.simulator_bench import has_library
from sosmith.sim.simulators import find_simulator
from sosmith.sim.verilated_model import Builder, Model, _clock_before

ENDS = ("tdata", "tvalid", "tready")


def writing(text: str, made: list[str] | None = None) -> Callable[[Path], None]:
    """Return a function that makes an entry of one file."""

    def make(folder: Path) -> None:
        if made is not None:
            made.append(text)
        (folder / "text").write_text(text)

    return make


def text_of(cache: BuildCache, key: str, make: Callable[[Path], None]) -> str:
    with cache.entry("model", key, make) as folder:
        return (folder / "text").read_text()


def age(folder: Path, key: str, seconds: int) -> None:
    os.utime(folder / f"model-{key}", (seconds, seconds))


def test_an_entry_is_made_once(tmp_path: Path) -> None:
    cache, made = BuildCache(tmp_path / "cache"), list[str]()
    assert not cache.has("model", "aa")
    assert [text_of(cache, "aa", writing("one", made)) for _ in range(3)] == ["one"] * 3
    assert text_of(cache, "ab", writing("two", made)) == "two"
    assert made == ["one", "two"]
    assert cache.has("model", "aa")


def test_keys_differ_with_every_part() -> None:
    keys = {key_of(), key_of("a", "b"), key_of("ab"), key_of(["a", "b"]), key_of("a", "c")}
    assert len(keys) == 5


@pytest.mark.parametrize("damage", ["changed", "cut", "gone", "one more", "no digests", "digests cut"])
def test_a_damaged_entry_is_made_again(damage: str, tmp_path: Path) -> None:
    cache, made = BuildCache(tmp_path), list[str]()
    text_of(cache, "aa", writing("sound", made))
    place = tmp_path / "model-aa"
    damages: dict[str, Callable[[], object]] = {
        "changed": lambda: (place / "text").write_text("spoilt"),
        "cut": lambda: (place / "text").write_text("sou"),
        "gone": (place / "text").unlink,
        "one more": lambda: (place / "other").write_text("x"),
        "no digests": (place / "digests.json").unlink,
        "digests cut": lambda: (place / "digests.json").write_text('{"text": "2'),
    }
    damages[damage]()
    assert not cache.has("model", "aa")
    assert text_of(cache, "aa", writing("sound", made)) == "sound"
    assert made == ["sound", "sound"]
    assert sorted(path.name for path in place.iterdir()) == ["digests.json", "text"]


def test_a_failure_leaves_no_entry(tmp_path: Path) -> None:
    def failing(folder: Path) -> None:
        (folder / "text").write_text("half")
        raise RuntimeError("compiler")

    cache = BuildCache(tmp_path)
    with pytest.raises(RuntimeError, match=r"^compiler$"):
        text_of(cache, "aa", failing)
    assert not cache.has("model", "aa")
    assert text_of(cache, "aa", writing("whole")) == "whole"


def test_a_killed_process_leaves_the_cache_whole(tmp_path: Path) -> None:
    text_of(BuildCache(tmp_path), "bb", writing("older"))
    program = (
        "import sys, time; from pathlib import Path; from sosmith.sim.build_cache import BuildCache\n"
        "def make(folder):\n"
        "    (folder / 'text').write_text('half'); print('begun', flush=True); time.sleep(600)\n"
        "with BuildCache(Path(sys.argv[1])).entry('model', 'aa', make): pass"
    )
    with subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, text=True) as killed:
        assert killed.stdout is not None
        assert killed.stdout.readline() == "begun\n"
        assert (tmp_path / "model-aa.new" / "text").exists()
        killed.send_signal(signal.SIGKILL)
    cache = BuildCache(tmp_path)
    assert (cache.has("model", "aa"), cache.has("model", "bb")) == (False, True)
    assert text_of(cache, "cc", writing("another")) == "another"  # which also clears up
    assert sorted(path.name for path in tmp_path.iterdir()) == ["locks", "model-bb", "model-cc"]
    assert text_of(cache, "aa", writing("whole")) == "whole"


def test_two_at_once_make_it_once(tmp_path: Path) -> None:
    begun, go_on, made, found = threading.Event(), threading.Event(), list[str](), list[str]()

    def slowly(folder: Path) -> None:
        begun.set()
        assert go_on.wait(60)
        writing("one", made)(folder)

    first = threading.Thread(target=lambda: found.append(text_of(BuildCache(tmp_path), "aa", slowly)))
    second = threading.Thread(target=lambda: found.append(text_of(BuildCache(tmp_path), "aa", writing("two", made))))
    first.start()
    assert begun.wait(60)
    second.start()
    second.join(0.2)
    assert second.is_alive()  # it waits
    assert text_of(BuildCache(tmp_path), "bb", writing("other")) == "other"  # which it need not for another entry
    go_on.set()
    first.join(60)
    second.join(60)
    assert (found, made) == (["one", "one"], ["one"])


def test_what_was_not_used_for_long_is_removed_beyond_the_limit(tmp_path: Path) -> None:
    cache = BuildCache(tmp_path, limit=4000)
    for second, key in enumerate(("aa", "bb", "cc")):
        text_of(cache, key, writing(key * 500))
        age(tmp_path, key, second)
    text_of(cache, "aa", writing(""))  # used again
    with cache.entry("model", "bb", writing("")):  # in use
        age(tmp_path, "bb", 0)
        text_of(cache, "dd", writing("d" * 1000))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["locks", "model-aa", "model-bb", "model-dd"]
    text_of(cache, "ee", writing("e" * 5000))  # larger than the limit by itself
    assert sorted(path.name for path in tmp_path.iterdir()) == ["locks", "model-ee"]
    assert LIMIT == 512 * 2**20


def test_a_kind_is_known_by_what_is_there(tmp_path: Path) -> None:
    cache = BuildCache(tmp_path)
    assert not cache.has_any("library")
    (tmp_path / "library-0123.new").mkdir()  # of a killed process
    (tmp_path / "model-0123").mkdir()
    assert not cache.has_any("library")
    (tmp_path / "library-0123").mkdir()
    assert cache.has_any("library")


def test_emptying_it(tmp_path: Path) -> None:
    cache = BuildCache(tmp_path)
    for key in ("aa", "bb"):
        text_of(cache, key, writing("x" * 1000))
    with cache.entry("model", "bb", writing("")):
        assert 1000 <= cache.clear() < 1200
    assert [cache.has("model", key) for key in ("aa", "bb")] == [False, True]
    assert cache.clear() > 0
    assert [path.name for path in tmp_path.iterdir()] == ["locks"]


def test_the_folder_is_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache_folder() == tmp_path / "cache" / "sosmith" / "verilator"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # which the standard has one ignore
    assert cache_folder() == tmp_path / "home" / ".cache" / "sosmith" / "verilator"
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert cache_folder() is None


@pytest.mark.slow
def test_a_core_built_elsewhere_is_not_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the user's own cache, for the sake of the library; the text of the core is new to it."""
    text = f"/* {tmp_path} {os.getpid()} */\n{SOUND}"
    tool = find_simulator("verilator", tmp_path / "bin")
    for name, each in {"one": text, "two": text, "other": text.replace("16'sd3", "16'sd4")}.items():
        (tmp_path / name).mkdir()
        ports = ("aclk", "aresetn", *(f"{side}_{end}" for side in ("s_axis", "m_axis") for end in ENDS))
        model = Model(source=write(tmp_path / name, each), top="stand_in", ports=ports, signals=(), waves=False)
        with (tmp_path / name / "log.txt").open("w+", encoding="utf-8") as log:
            builder = Builder(tool.version, tool.environment, tmp_path / name, log)
            builder.build(model, tmp_path / name / "model")
            log.seek(0)
            assert "invalid-pch" not in log.read()  # headers that are compiled once would not be used
        assert builder.has_library()
    one, two, other = ((tmp_path / name / "model").read_bytes() for name in ("one", "two", "other"))
    assert one == two != other
    assert [(tmp_path / name / "objects").exists() for name in ("one", "two", "other")] == [True, False, True]
    assert has_library()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert not has_library()


CLOCK = "__Vtrigprevexpr___TOP__aclk__0"


@pytest.mark.parametrize(
    ("members", "flags"),
    [
        (f"CData/*0:0*/ {CLOCK};\n    CData/*0:0*/ __VactContinue;", [f"-DBENCH_CLOCK_BEFORE={CLOCK}"]),
        ("CData/*0:0*/ __Vtrigprevexpr___TOP__sclk__0;", []),  # another clock
        (f"CData/*0:0*/ {CLOCK};\n    CData/*0:0*/ {CLOCK[:-1]}1;", []),  # which of the two, nobody knows
        ("VL_IN8(aclk,0,0);", []),  # as another version may have it
    ],
)
def test_the_member_that_remembers_the_clock_is_found(members: str, flags: list[str], tmp_path: Path) -> None:
    header = tmp_path / "Vtop___024root.h"
    header.write_text(f"class Vtop___024root {{\n  public:\n    {members}\n}};\n", encoding="utf-8")
    assert _clock_before(header) == flags
