"""What documents show, renewed."""

import re
import shlex
from pathlib import Path

from click.testing import CliRunner

from sosmith.cli import cli

ROOT = Path(__file__).parents[2]


_SHOWN = re.compile(r"```sh\n(?P<lines>[^`]*)```\n\n```text\n(?P<output>[^`]*)```")
"""Lines of a shell, directly followed by what they print."""

_SILENT = re.compile(r"```sh\n(?P<lines>[^`]*)```\n(?!\n```text)")
"""Lines of a shell that nothing is shown of."""


def run(line: str, folder: Path) -> str:
    """Carry out a line of the README in `folder`; return what it prints on stdout."""
    if written := re.fullmatch(r"cat > (\S+) <<'END'\n(.*\n)END", line, flags=re.DOTALL):
        (folder / written[1]).write_text(written[2], encoding="utf-8")
        return ""
    if kept := re.fullmatch(r"grep -v (\w+) (\S+) > (\S+)", line):
        lines = (folder / kept[2]).read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / kept[3]).write_text("".join(each for each in lines if kept[1] not in each), encoding="utf-8")
        return ""
    command, *arguments = shlex.split(line)
    assert command == "./run"
    result = CliRunner(env={"COLUMNS": "100"}).invoke(cli, arguments)
    # `verify --files` proves a part and says so by its status
    good = {0, 4} if arguments[0] == "verify" else {0}
    assert result.exit_code in good, f"{line}: {result.output}{result.exception!r}"
    return result.stdout


def with_output(text: str, folder: Path) -> str:
    """Renew what the lines of a document's shell blocks print, one block after another in the same folder."""

    def renewed(block: re.Match[str]) -> str:
        printed = "".join(run(line, folder) for line in block["lines"].splitlines())
        shown = "".join(f"{line.rstrip()}\n" for line in printed.strip().splitlines())
        return f"```sh\n{block['lines']}```\n\n```text\n{shown}```"

    return _SHOWN.sub(renewed, text)


def carry_out(text: str, folder: Path) -> None:
    """Run the lines of a document's shell blocks of which no output is shown."""
    for block in _SILENT.finditer(text):
        for line in block["lines"].splitlines():
            run(line, folder)


def furnish(folder: Path) -> Path:
    """Put the examples where a clone of the repository has them."""
    (folder / "examples").symlink_to(ROOT / "examples")
    return folder
