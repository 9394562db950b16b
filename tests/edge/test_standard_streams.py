"""Standard streams that are closed or broken, locales, masks: what can be written is, and the status tells."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands.command_line import FILTER

LOST = "sosmith: error: stdout must be open, not closed: what was printed is lost\n"
FULL = "sosmith: error: stdout must take what is printed, not: No space left on device\n"


def shell(line: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Let a shell call `sosmith`, which stands for the command, in a folder."""
    function = f'sosmith() {{ "{sys.executable}" -m sosmith.cli "$@"; }}\n'
    return subprocess.run(
        ["bash", "-c", function + line],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        timeout=300,
    )


@pytest.mark.sweep(2)
@pytest.mark.parametrize("closed", ["", "<&-", ">&-", "2>&-", "<&- >&-", "<&- 2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams(closed: str, tmp_path: Path) -> None:
    made = shell(f"sosmith init a.toml {closed}", tmp_path)
    assert (made.returncode, made.stdout) == (0, "")
    assert "\n[filter]" in (tmp_path / "a.toml").read_text()
    told = "sosmith: wrote a.toml; next: sosmith design a.toml\n"
    assert made.stderr == ("" if "2>&-" in closed else told)

    listed = shell(f"sosmith init --list {closed}", tmp_path)
    lost = closed.startswith(">") or " >" in closed
    assert listed.returncode == (3 if lost else 0)
    assert ("flange_wear" in listed.stdout) == (not lost)
    assert listed.stderr == (LOST if lost and "2>&-" not in closed else "")

    refused = shell(f"sosmith design none.toml {closed}", tmp_path)
    assert refused.returncode == 2
    assert "Traceback" not in refused.stderr


@pytest.mark.slow
def test_files_are_written_without_any_stream(tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text(FILTER)
    assert shell("sosmith generate plain.toml -o out <&- >&- 2>&-", tmp_path).returncode == 3
    assert len(list((tmp_path / "out").iterdir())) == 6


def test_a_stdout_that_is_full(tmp_path: Path) -> None:
    made = shell("sosmith init --list > /dev/full", tmp_path)
    assert (made.returncode, made.stderr) == (3, FULL)


@pytest.mark.slow
def test_files_that_are_written_after_a_stdout_that_is_full(tmp_path: Path) -> None:
    record = "time_s,clearance_mm\n" + "".join(f"{86400 * day},{1 + 0.01 * day}\n" for day in range(40))
    (tmp_path / "wheel.csv").write_text(record)
    made = shell("sosmith wear wheel.csv --initial 1 --warning 7 --limit 9 --plot a.svg > /dev/full", tmp_path)
    assert (made.returncode, made.stderr.splitlines()[-2:]) == (3, ["sosmith: wrote a.svg", FULL.rstrip()])
    assert (tmp_path / "a.svg").read_text().endswith("</svg>\n")


@pytest.mark.sweep(1)
@pytest.mark.parametrize("to", ["/dev/full", ">(true)"])
def test_a_stderr_that_takes_nothing(to: str, tmp_path: Path) -> None:
    made = shell(f"sosmith init a.toml 2> {to}", tmp_path)
    assert (made.returncode, made.stdout) == (0, "")
    assert shell(f"sosmith design none.toml 2> {to}", tmp_path).returncode == 2
    assert shell(f"sosmith init --nonsense 2> {to}", tmp_path).returncode == 2


def test_a_reader_that_leaves(tmp_path: Path) -> None:
    made = shell("sosmith init --list | head -1; exit ${PIPESTATUS[0]}", tmp_path)
    assert (made.returncode, made.stderr, len(made.stdout.splitlines())) == (0, "", 1)


@pytest.mark.sweep(2)
@pytest.mark.parametrize("locale", ["C", "POSIX", "xx_YY.none", "en_US.ISO-8859-1"])
@pytest.mark.parametrize("encoding", ["", "ascii", "ascii:strict"])
def test_locales(locale: str, encoding: str, tmp_path: Path) -> None:
    made = shell("sosmith init --list && sosmith design ä.toml", tmp_path, LC_ALL=locale, PYTHONIOENCODING=encoding)
    assert made.returncode == 2
    assert "flange_wear" in made.stdout
    (told,) = [line for line in made.stderr.splitlines() if not line.startswith("bash: ")]  # it knows no locale either
    assert told.startswith("sosmith: error: ")


@pytest.mark.parametrize("mask", ["000", "027", "777"])
def test_what_is_made_belongs_to_its_user_whatever_the_mask(mask: str, tmp_path: Path) -> None:
    assert shell(f"umask {mask}; sosmith init new/a.toml", tmp_path).returncode == 0
    folder, file = (tmp_path / "new").stat().st_mode & 0o777, (tmp_path / "new/a.toml").stat().st_mode & 0o777
    others = 0o077 & ~int(mask, 8)
    assert (folder, file) == (0o700 | others, 0o600 | (others & 0o066))
