"""The documents: what the README shows is what the commands print, and the maps of the code are true.

Run as a script, it renews what is generated in them: the output in the README, the file table of the
architecture, the register map, the protocol, the fields of the streams, the commands and the schema of the calibration,
the vehicle and its parameters, and the pages of the commands and of the Python interface.
"""

import contextlib
import re
import shlex
import shutil
import tempfile
import textwrap
from pathlib import Path

import click
import pytest
from benchmarks.hardware_pictures import pictures
from tests.documents import commands_page
from tests.documents.protocol_page import with_parts
from tests.documents.python_page import first_example, page
from tests.documents.shown import _SHOWN, ROOT, furnish, run, with_output
from tests.gen.designs import example_design
from tests.house import ROOMS, WITH_SUB_ROOMS, file_table, picture

from sosmith.cli import cli
from sosmith.commands.tables import combinations
from sosmith.gen.architectures.registry import ARCHITECTURES
from sosmith.gen.output.core_facts import core_facts
from sosmith.gen.output.manifest import manifest
from sosmith.gen.reload.register_map import markdown
from sosmith.gen.specification.combinations import TERMS
from sosmith.instrument.calibration.store.schema import SCHEMA
from sosmith.instrument.vehicle.parameters import built_in
from sosmith.instrument.vehicle.vehicle_report import parameters_json
from sosmith.interface.specification import Specification

README = ROOT / "README.md"
ARCHITECTURE = ROOT / "docs" / "architecture.md"
CALIBRATION = ROOT / "docs" / "calibration.md"
PRINTING = [*(ROOT / "docs" / f"{name}.md" for name in ("spectrum", "wear", "vehicle", "sensors")), CALIBRATION]
"""Documents whose shell blocks stand above what they print."""
IMAGES = ROOT / "docs" / "images"
DRAWN = ("vehicle.svg", "calibration.svg")
"""Pictures that the shell blocks of these documents draw."""
PYTHON = ROOT / "docs" / "python.md"
COMMANDS = ROOT / "docs" / "commands.md"
HARDWARE = ROOT / "docs" / "hardware.md"
PROTOCOL = ROOT / "docs" / "protocol.md"
REGISTERS = ROOT / "docs" / "registers.md"
VEHICLE = ROOT / "docs" / "vehicle.md"
DOCUMENTS = [README, ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
BY_CI = {"./run demo", "./run test"}
"""Lines that other tests and the set-up on a fresh machine stand for."""
TAKES_LONG = ("./run simulate ", "./run compare ", "./run build ")
"""Beginnings of the lines that only the longer test carries out."""

_COMBINATIONS = re.compile(r"(?<=<!-- combinations -->\n).*?(?=<!-- end of combinations -->)", re.DOTALL)
_PROOFS = re.compile(r"(?<=<!-- proofs -->\n).*?(?=<!-- end of proofs -->)", re.DOTALL)
_FIELDS = re.compile(r"(?<=<!-- fields -->\n).*?(?=<!-- end of fields -->)", re.DOTALL)
_OUTPUT = re.compile(r"(?<=```text\n).*?(?=```)", re.DOTALL)
_PARAMETERS = re.compile(r"(?<=<!-- parameters -->\n).*?(?=<!-- end of parameters -->)", re.DOTALL)
_REGISTERS = re.compile(r"(?<=<!-- registers -->\n).*?(?=<!-- end of registers -->)", re.DOTALL)
_SCHEMA = re.compile(r"(?<=<!-- schema -->\n).*?(?=<!-- end of schema -->)", re.DOTALL)
_HOUSE = re.compile(r"<!-- (?P<what>picture|files) of (?P<room>\w+) -->\n.*?<!-- end -->", re.DOTALL)
"""Parts of the architecture that are read off the code."""


def shell_lines() -> list[str]:
    """All lines of the README's shell blocks, a here-document as one."""
    blocks = re.findall(r"```sh\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.findall(r"^(?:cat > (?s:.*?)\nEND|.+)$", "\n".join(blocks), flags=re.MULTILINE)


def worked_example(folder: Path) -> str:
    """Print what the README shows under its specification: the design."""
    lines = shell_lines()
    for specification in (line for line in lines if line.startswith("cat > ")):
        run(specification, folder)
    printed = run(next(line for line in lines if line.startswith("./run design ")), folder)
    return printed.strip() + "\n"


def schema() -> str:
    """Statements that make the store of measurements, as SQL."""
    return "```sql\n" + "".join(f"{textwrap.dedent('    ' + statement)};\n" for statement in SCHEMA) + "```\n"


def with_house(text: str) -> str:
    """Renew the pictures of rooms and the tables of files in `text`."""

    def renewed(part: re.Match[str]) -> str:
        shown = picture(part["room"]) if part["what"] == "picture" else file_table(part["room"])
        return f"<!-- {part['what']} of {part['room']} -->\n\n{shown}\n<!-- end -->"

    return _HOUSE.sub(renewed, text)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return furnish(tmp_path)


def test_the_output_shown_is_what_the_command_prints(folder: Path) -> None:
    (shown,) = _OUTPUT.findall(README.read_text(encoding="utf-8"))
    assert shown == worked_example(folder)


def test_every_line_works_or_is_understood(folder: Path) -> None:
    lines = [line for line in shell_lines() if line not in BY_CI]
    assert len(lines) > 5
    for line in lines:
        if line.startswith(TAKES_LONG):
            name, *arguments = shlex.split(line)[1:]
            above = click.Context(cli, **cli.context_settings)  # a command keeps the help option of its first call
            command = cli.get_command(above, name)
            assert command is not None
            command.make_context(name, arguments, parent=above)
        else:
            run(line, folder)


@pytest.mark.slow
def test_every_line_works(folder: Path) -> None:
    for line in shell_lines():
        if line not in BY_CI:
            run(line, folder)


def test_the_architecture_shows_the_code_as_it_is() -> None:
    shown = ARCHITECTURE.read_text(encoding="utf-8")
    parts = {(part["what"], part["room"]) for part in _HOUSE.finditer(shown)}
    assert parts == {("files", room) for room in ROOMS} | {("picture", room) for room in WITH_SUB_ROOMS}
    assert shown == with_house(shown)


def test_the_register_map_is_up_to_date() -> None:
    assert _REGISTERS.findall(REGISTERS.read_text(encoding="utf-8")) == [markdown()]


def test_the_tables_and_bytes_of_the_protocol_are_those_of_the_code() -> None:
    shown = PROTOCOL.read_text(encoding="utf-8")
    assert shown == with_parts(shown)
    assert shown.count("    > ") > 5


def field_table() -> str:
    """Return the names of the streams' fields in cores of two examples, as their manifests have them, in Markdown."""
    rows = []
    for example, core in (
        ("flange_wear_bench", "instrument"),
        ("flange_wear_bench", "calibration"),
        ("flange_wear_bench", "filter"),
        ("audio_lowpass", "filter"),
    ):
        streams = manifest(core_facts(example_design(f"{example}.toml", core=core)))["streams"]
        inputs, outputs = (
            ", ".join(f"`{field['name']}`" for field in streams[name]["fields"]) for name in ("s_axis", "m_axis")
        )
        rows.append(f"| {example} | {core} | {inputs} | {outputs} |\n")
    return "| example | core | fields of `s_axis_tdata` | field of `m_axis_tdata` |\n|---|---|---|---|\n" + "".join(
        rows
    )


@pytest.mark.slow
def test_the_names_of_the_fields_are_those_of_the_manifest() -> None:
    assert _FIELDS.findall(HARDWARE.read_text(encoding="utf-8")) == [field_table()]


def combination_table() -> str:
    """Return what `sosmith combinations --markdown` prints."""
    return combinations.markdown(Specification.combinations())


def proof_table() -> str:
    """Return what is proven of each architecture from its files, in Markdown."""
    rows = "".join(f"| `{name}` | {ARCHITECTURES[name].checked} |\n" for name in TERMS)
    return f"| architecture | proven from the files |\n|---|---|\n{rows}"


def test_what_is_proven_of_an_architecture_is_what_its_class_says() -> None:
    assert _PROOFS.findall(HARDWARE.read_text(encoding="utf-8")) == [proof_table()]


def test_the_table_of_combinations_is_that_of_the_command() -> None:
    assert _COMBINATIONS.findall(HARDWARE.read_text(encoding="utf-8")) == [combination_table()]


@pytest.mark.sweep(1)
@pytest.mark.parametrize("document", PRINTING, ids=lambda path: path.name)
def test_commands_print_what_is_shown(document: Path, folder: Path) -> None:
    shown = document.read_text(encoding="utf-8")
    assert _SHOWN.search(shown)
    assert shown == with_output(shown, folder)
    for drawn in folder.glob("*.svg"):
        if drawn.name in DRAWN:
            assert drawn.read_bytes() == (IMAGES / drawn.name).read_bytes()


PICTURES = {
    "wear.svg": "./run wear examples/wear/wheel.csv --initial 1.5 --warning 7 --limit 9 --sensor-range 10.5"
    " --plot wear.svg",
}
"""Pictures that a command of a document draws beside the blocks that show its output; others are checked elsewhere."""


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_what_the_commands_draw(name: str, folder: Path) -> None:
    run(PICTURES[name], folder)
    assert (folder / name).read_bytes() == (IMAGES / name).read_bytes()


def test_the_python_page_is_up_to_date() -> None:
    assert PYTHON.read_text(encoding="utf-8") == page()


def test_the_page_of_the_commands_is_what_they_say() -> None:
    assert COMMANDS.read_text(encoding="utf-8") == commands_page.page()


def test_the_readme_shows_the_first_example_of_the_python_page() -> None:
    (shown,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    lines = [line for line in shown.splitlines() if line]
    assert lines[:-1] == first_example()[:-1]
    assert lines[-1].startswith("print(")
    assert len(lines) < 10


def test_the_schema_is_the_one_of_the_store() -> None:
    assert _SCHEMA.findall(CALIBRATION.read_text(encoding="utf-8")) == [schema()]


def parameter_table() -> str:
    """Return the built-in parameters of the vehicle with unit and source, in Markdown."""
    rows = [
        f"| `{path}` | {entry['value']:g} {entry['unit'] if entry['unit'] != '1' else ''}".rstrip()
        + f" | {entry['source']} |\n"
        for path, entry in parameters_json(built_in()).items()
    ]
    return "| parameter | value | source |\n|---|---|---|\n" + "".join(rows)


def test_the_parameters_of_the_vehicle_are_those_of_its_file() -> None:
    assert _PARAMETERS.findall(VEHICLE.read_text(encoding="utf-8")) == [parameter_table()]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_paths_lead_somewhere(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
    paths = re.findall(rf"`((?:{'|'.join(ROOMS)}|src|tests|docs|examples)/[\w./]*)`", text)
    missing = [link for link in links if not (document.parent / link).exists()]
    missing += [path for path in paths if not (ROOT / path).exists()]
    assert missing == []


def renew(document: Path, part: re.Pattern[str], text: str) -> None:
    """Write a generated part of a document anew."""
    document.write_text(part.sub(lambda _: text, document.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        renew(README, _OUTPUT, worked_example(furnish(Path(scratch))))
        for document in PRINTING:
            text = document.read_text(encoding="utf-8")
            document.write_text(with_output(text, Path(scratch)), encoding="utf-8")
        for name in DRAWN:
            shutil.copyfile(name, IMAGES / name)
    ARCHITECTURE.write_text(with_house(ARCHITECTURE.read_text(encoding="utf-8")), encoding="utf-8")
    PYTHON.write_text(page(), encoding="utf-8")
    COMMANDS.write_text(commands_page.page(), encoding="utf-8")
    renew(HARDWARE, _FIELDS, field_table())
    renew(HARDWARE, _COMBINATIONS, combination_table())
    renew(HARDWARE, _PROOFS, proof_table())
    renew(REGISTERS, _REGISTERS, markdown())
    PROTOCOL.write_text(with_parts(PROTOCOL.read_text(encoding="utf-8")), encoding="utf-8")
    renew(CALIBRATION, _SCHEMA, schema())
    renew(VEHICLE, _PARAMETERS, parameter_table())


def test_the_pictures_of_the_hardware_show_it_as_it_is() -> None:
    made = pictures()
    assert {name: (ROOT / name).read_text(encoding="utf-8") for name in made} == made
