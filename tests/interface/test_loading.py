"""What loads when: the import, help, completion and refusals that need no design do without the large libraries."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click import Context
from tests.commands.command_line import QUICK

import sosmith
from sosmith.cli import _COMMANDS, cli

LARGE = ("numpy", "scipy", "matplotlib", "amaranth", "pydantic", "rich", "flint", "openpyxl")
EXAMPLE = Path(__file__).parents[2] / "examples" / "audio_lowpass.toml"

SCRIPT = """\
import sys
try:
    {statement}
except SystemExit:
    pass
print(*sorted({large!r} & sys.modules.keys()), file=sys.stderr)
"""


def loaded(statement: str, *arguments: str, **environment: str) -> list[str]:
    """Run a statement in a process of its own; return which large libraries it loaded, the last line of stderr."""
    script = SCRIPT.format(statement=statement, large=set(LARGE))
    ended = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | environment,
    )
    return ended.stderr.splitlines()[-1].split()


def run(*arguments: str, **environment: str) -> list[str]:
    return loaded("from sosmith.__main__ import main; main()", *arguments, **environment)


def test_the_command_is_also_the_package() -> None:
    command = [sys.executable, "-m", "sosmith", "--version"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    assert ended.stdout == f"sosmith, version {sosmith.__version__}\n"


def test_the_import_loads_none_of_them() -> None:
    assert loaded("import sosmith; dir(sosmith); sosmith.SosmithError") == []


def test_a_design_loads_them() -> None:
    assert {"numpy", "flint"} <= set(loaded("import sosmith; sosmith.design"))


def test_a_design_loads_nothing_that_it_does_not_need() -> None:
    design = "import sosmith; made = sosmith.design(sys.argv[1]); made.scenarios; made.manifest; "
    others = {"amaranth", "pydantic", "scipy.signal._signal_api", "scipy.stats", "scipy.linalg"}
    script = f"import sys; {design}print(*sorted({others} & sys.modules.keys()))"
    ended = subprocess.run([sys.executable, "-c", script, str(EXAMPLE)], capture_output=True, text=True, check=True)
    assert ended.stdout.split() == []


@pytest.mark.sweep(1)
@pytest.mark.parametrize("words", [("design",), ("design", "--json"), ("combinations",)])
def test_commands_do_without_statistics(words: tuple[str, ...], tmp_path: Path) -> None:
    script = "import sys\nfrom sosmith.__main__ import main\ntry:\n    main()\nexcept SystemExit:\n    pass\n"
    found = "print(*sorted({'scipy.stats', 'matplotlib'} & sys.modules.keys()), file=sys.stderr)"
    (tmp_path / "plain.toml").write_text(QUICK, encoding="utf-8")
    spec = [str(tmp_path / "plain.toml")] if words[0] == "design" else []
    command = [sys.executable, "-c", script + found, words[0], *spec, *words[1:], "-q"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    assert ended.stderr.splitlines()[-1] == ""


NOTHING = {
    "version": ("--version",),
    "help": ("--help",),
    "no command": (),
    "unknown command": ("simulte",),
    "missing specification": ("design", "none.toml"),
    "specification that is no TOML": ("design", __file__),
    "unknown board": ("design", str(EXAMPLE), "--board", "icebraker"),
    "unknown board for gates": ("simulate", str(EXAMPLE), "--gates", "icebraker"),
    "unknown simulator": ("simulate", str(EXAMPLE), "--simulator", "veriltor"),
    "unknown realization": ("generate", str(EXAMPLE), "--realization", "df3"),
    "plot of another format": ("vehicle", "--plot", "run.pdf"),
}


@pytest.mark.sweep(4)
@pytest.mark.parametrize("arguments", NOTHING.values(), ids=NOTHING)
def test_what_loads_none_of_them(arguments: tuple[str, ...]) -> None:
    assert run(*arguments) == []


@pytest.mark.sweep(6)
@pytest.mark.parametrize("name", cli.list_commands(Context(cli)))
def test_help_of_a_command_loads_none_of_them(name: str) -> None:
    assert run(name, "--help") == []


def test_the_list_of_commands_tells_what_their_help_does() -> None:
    with Context(cli) as context:
        for name, (_, _, summary) in _COMMANDS.items():
            command = cli.get_command(context, name)
            assert command is not None
            assert command.get_short_help_str(limit=200).rstrip(".") == summary.rstrip(".")


def test_completion_loads_none_of_them() -> None:
    words = {"_SOSMITH_COMPLETE": "bash_complete", "COMP_WORDS": "sosmith sim", "COMP_CWORD": "1"}
    assert loaded("sys.argv[0] = 'sosmith'; from sosmith.__main__ import main; main()", **words) == []


CHECKED = {
    "list of traces": ("emulate", str(EXAMPLE)),
    "unknown trace": ("simulate", str(EXAMPLE), "--trace", "nois"),
    "unknown trace to emulate": ("emulate", str(EXAMPLE), "nois"),
}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("arguments", CHECKED.values(), ids=CHECKED)
def test_what_needs_the_specification_alone(arguments: tuple[str, ...]) -> None:
    assert set(run(*arguments)) <= {"rich"}


def test_every_public_name_is_there() -> None:
    assert set(sosmith.__all__) <= set(dir(sosmith))
    assert all(getattr(sosmith, name) is not None for name in sosmith.__all__)
    with pytest.raises(AttributeError, match=r"^module 'sosmith' has no attribute 'desing'$"):
        _ = sosmith.desing  # type: ignore[attr-defined]
