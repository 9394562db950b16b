"""docs/speed.md, of which every benchmark of speed writes its own section."""

from __future__ import annotations

from pathlib import Path

DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "speed.md"


def shown(name: str) -> str:
    """Return the section of a benchmark, as it stands in the document."""
    return _parts(name)[1]


def renew(name: str, text: str) -> None:
    """Write the section of a benchmark anew."""
    before, _, after = _parts(name)
    DOCUMENT.write_text(f"{before}{text}{after}", encoding="utf-8")


def _parts(name: str) -> tuple[str, str, str]:
    """Split the document into what is before a section, the section, and what is after it."""
    before, begin, rest = DOCUMENT.read_text(encoding="utf-8").partition(f"<!-- {name} -->\n")
    section, end, after = rest.partition(f"<!-- end of {name} -->")
    if not (begin and end):
        raise ValueError(f"{DOCUMENT} must have a section {name}")
    return before + begin, section, end + after
