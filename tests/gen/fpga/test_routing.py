"""A router that goes on for ever is stopped, and the other one takes its place."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from sosmith.gen.fpga.routing import OTHER_ROUTER, is_endless, placed, waited

HEAD = "Info: Routing 4224 arcs.\nInfo:    IterCnt |  w/ripup   wo/ripup |  w/r  wo/r |      arcs|\n"


def row(tries: int) -> str:
    """Return what nextpnr says after so many tries."""
    return f"Info:     {tries} |      838       2634 |  280   630 |      1041|       0.45       1.47|\n"


def test_only_far_more_tries_than_connections_are_endless() -> None:
    assert not is_endless("")
    assert not is_endless(HEAD)
    assert not is_endless(HEAD + row(5282))
    assert not is_endless(HEAD + row(84480))
    assert is_endless(HEAD + row(84481))
    assert not is_endless("Info: Routing 0 arcs.\n" + row(1000))  # router2 has its result checked by the other one


class Placer:
    """Stands for nextpnr: says so many tries, ends with a status unless it goes on for ever, and ends with router2."""

    def __init__(self, log: Path, tries: int, *, forever: bool) -> None:
        self._log, self._tries, self._forever = log, tries, forever
        self.calls: list[list[str]] = []

    def __call__(self, arguments: Sequence[str]) -> "subprocess.Popen[bytes]":
        self.calls.append([*arguments])
        other = [*arguments[-2:]] == [*OTHER_ROUTER]
        rest = "import time; time.sleep(600)" if self._forever and not other else f"raise SystemExit({3 + other})"
        said = "Info: Routing 0 arcs.\n" if other else HEAD + row(self._tries)
        script = f"import sys; sys.stdout.write({said!r}); sys.stdout.flush(); {rest}"
        with self._log.open("ab") as output:
            return subprocess.Popen([sys.executable, "-c", script], stdout=output)


@pytest.mark.parametrize(("tries", "forever", "status"), [(5000, False, 3), (90_000, True, 4), (90_000, False, 4)])
def test_the_other_router_is_taken_by_the_number_of_tries_alone(
    tmp_path: Path, tries: int, forever: bool, status: int
) -> None:
    log = tmp_path / "log"
    log.write_text(HEAD + row(999_999), encoding="utf-8")  # of a program before it
    placer = Placer(log, tries, forever=forever)
    assert placed(placer, ["--seed", "1"], log) == status
    assert placer.calls[0] == ["--seed", "1"]
    said = "The first router has tried too often for these connections; the second one takes over."
    assert (said in log.read_text(encoding="utf-8")) is (status == 4)
    assert placer.calls[1:] == ([["--seed", "1", *OTHER_ROUTER]] if status == 4 else [])


def test_what_ends_the_wait_ends_the_program() -> None:
    def interrupted() -> bool:
        raise KeyboardInterrupt

    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]) as process:
        with pytest.raises(KeyboardInterrupt):
            waited(process, interrupted)
        assert process.wait(60) != 0
