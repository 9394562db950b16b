"""Outputs of every command: what is no file of their own is refused before anything is done."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from sosmith.cli import cli
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import OutputFile, OutputFolder

INPUT = "in.toml"


def leaves(command: click.Command, names: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Yield every command that is no group, with the words that call it."""
    if not isinstance(command, click.Group):
        yield names, command
        return
    context = click.Context(command)
    for name in command.list_commands(context):
        found = command.get_command(context, name)
        assert found is not None
        yield from leaves(found, (*names, name))


def required(command: click.Command) -> list[str]:
    """Return the least that a command must be called with."""
    words: list[str] = []
    for parameter in command.params:
        if parameter.required:
            count = max(parameter.nargs, 1)
            value = "1" if isinstance(parameter.type, click.types.FloatParamType | click.types.IntRange) else INPUT
            if isinstance(parameter, click.Option):
                words.append(parameter.opts[0])
            words += [value] * count
    return words


OUTPUTS = [
    pytest.param(names, command, parameter, id=f"{' '.join(names)} {parameter.opts[0]}")
    for names, command in leaves(cli)
    for parameter in command.params
    if isinstance(parameter.type, OutputFile)
]
INPUTS_TOO = [
    one
    for one in OUTPUTS
    if not one.values[2].type.in_place
    and any(
        isinstance(parameter.type, click.Path) and isinstance(parameter, click.Argument)
        for parameter in one.values[1].params
    )
]


def refused(names: tuple[str, ...], command: click.Command, parameter: click.Parameter, path: str) -> str:
    """Call a command with an output; return why it is refused."""
    result = CliRunner().invoke(cli, [*names, *arguments(command), parameter.opts[0], path])
    assert isinstance(result.exception, SpecificationError), result.output
    return str(result.exception)


def arguments(command: click.Command) -> list[str]:
    """Return what is required, and inputs that need not be given."""
    words = required(command)
    optional = [one for one in command.params if isinstance(one, click.Argument) and not one.required]
    return words + [INPUT for one in optional if isinstance(one.type, click.Path)]


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path(INPUT).write_text("what is read")
    Path("folder").mkdir()
    os.mkfifo("pipe")


def test_every_option_that_names_an_output_is_known() -> None:
    assert len(OUTPUTS) > 12
    for names, command in leaves(cli):
        for parameter in command.params:
            if "--output" in parameter.opts or "--plot" in parameter.opts:
                assert isinstance(parameter.type, OutputFile | OutputFolder), names


@pytest.mark.parametrize(("names", "command", "parameter"), OUTPUTS)
@pytest.mark.parametrize(
    ("path", "what"), [("/dev/full", "a device"), ("/dev/null", "a device"), ("pipe", "a pipe"), ("folder", "a folder")]
)
def test_what_is_no_file(
    names: tuple[str, ...], command: click.Command, parameter: click.Parameter, path: str, what: str
) -> None:
    message = refused(names, command, parameter, path)
    assert message == f"{path}: the output file must be a file, not {what}"


@pytest.mark.parametrize(("names", "command", "parameter"), INPUTS_TOO)
@pytest.mark.parametrize("way", ["itself", "link", "hard link", "long"])
def test_an_input_is_never_an_output(
    names: tuple[str, ...], command: click.Command, parameter: click.Parameter, way: str
) -> None:
    path = {"itself": INPUT, "long": f"folder/../{INPUT}"}.get(way, "other")
    if way == "link":
        Path(path).symlink_to(INPUT)
    elif way == "hard link":
        Path(path).hardlink_to(INPUT)
    message = refused(names, command, parameter, path)
    assert message == f"{path}: the output file must be another than what is read, not the same"
    assert Path(INPUT).read_text() == "what is read"


@pytest.mark.parametrize(("names", "command", "parameter"), OUTPUTS)
def test_stdout_is_an_output_where_it_is_the_default(
    names: tuple[str, ...], command: click.Command, parameter: click.Parameter
) -> None:
    if getattr(parameter.type, "stdout", False):
        assert "default: stdout" in parameter.help or "print it" in parameter.help  # type: ignore[attr-defined]
    else:
        message = refused(names, command, parameter, "-")
        assert message == "the output must be the name of a file here, not - for stdout"


def test_two_outputs_of_one_command_are_two_files() -> None:
    Path("one.svg").symlink_to("two.svg")
    result = CliRunner().invoke(cli, ["spectrum", INPUT, "-o", "two.svg", "--plot", "one.svg"])
    expected = "two.svg: each output must be a file of its own, not that of another output"
    assert str(result.exception) == expected
