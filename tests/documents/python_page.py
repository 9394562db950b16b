"""Writes docs/python.md from the docstrings of the public Python interface."""

import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any

import sosmith

TITLE = """# From Python

Written by `python -m tests.documents.test_documents` from the docstrings; nothing here is typed in, and the tests run
every example. `import sosmith` loads next to nothing: each name brings what it needs when it is first used. Everything
is typed.

"""

ORDER = (
    "Specification",
    "design",
    "Design",
    "Section",
    "Coefficient",
    "Certificate",
    "Proof",
    "Report",
    "Build",
    "compare",
    "Board",
    "Results",
)
ERRORS = (
    "SosmithError",
    "SpecificationError",
    "ShortfallError",
    "ToolError",
    "LinkError",
    "LinkLostError",
    "RefusedError",
)

_SECTION = re.compile(r"^(Parameters|Returns|Raises|Attributes|Examples)\n-+\n", re.MULTILINE)


def page() -> str:
    """Return docs/python.md."""
    names = [*ORDER, *(name for name in sosmith.__all__ if name[0] != "_" and name not in {*ORDER, *ERRORS}), *ERRORS]
    first = inspect.getdoc(importlib.import_module("sosmith.interface")) or ""
    entries = [_entry(name, getattr(sosmith, name)) for name in names]
    return TITLE + _markdown(first.split("\n\n", 1)[1]) + "".join(entries)


def first_example() -> list[str]:
    """Return the statements of the first example on the page."""
    text = inspect.getdoc(importlib.import_module("sosmith.interface")) or ""
    return re.findall(r"^>>> (.*)$", text, flags=re.MULTILINE)


def _entry(name: str, thing: Any) -> str:
    call = _call(name, thing) if inspect.isfunction(thing) else f"sosmith.{name}"
    parts = [f"\n## {call}\n\n{_markdown(inspect.getdoc(thing) or '')}"]
    if inspect.isclass(thing) and not issubclass(thing, Exception):
        parts += [f"\n### {heading}\n\n{_markdown(doc)}" for heading, doc in _members(thing)]
    return "".join(parts)


def _members(owner: type) -> Iterator[tuple[str, str]]:
    """Headings and docstrings of what is public in a class and documented, in the order of its file."""
    for name, member in vars(owner).items():
        target = member.__func__ if isinstance(member, classmethod) else member
        if not (name[0] != "_" or name == "__call__") or name in {"written"}:
            continue
        if inspect.isfunction(target):
            yield _call(f"{owner.__name__}.{name}", target), inspect.getdoc(target) or ""
        elif isinstance(target, property) or hasattr(target, "attrname"):
            yield f"{owner.__name__}.{name}", inspect.getdoc(target) or ""


def _call(name: str, function: Any) -> str:
    """Name and parameters of a function; types stand in the list of parameters."""
    shown = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in {"self", "cls"}:
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in shown:
            shown.append("*")
        default = parameter.default
        plain = default is parameter.empty or callable(default)
        star = "**" if parameter.kind is parameter.VAR_KEYWORD else ""
        optional = "..." if callable(default) and default is not parameter.empty else repr(default)
        shown.append(star + parameter.name + ("" if plain and optional != "..." else f"={optional}"))
    prefix = "" if "." in name else "sosmith."
    return f"{prefix}{name}({', '.join(shown)})".replace(".__call__", "")


def _markdown(doc: str) -> str:
    """Docstring in Markdown: lists for parameters and the like, code for examples."""
    text, *parts = _SECTION.split(doc)
    made = [_prose(text)]
    for title, content in zip(parts[::2], parts[1::2], strict=True):
        if title == "Examples":
            made.append(f"```python\n{content.strip()}\n\n```\n")  # a blank line ends what doctest expects
        else:
            made.append(f"**{title}**\n\n{_items(content)}")
    return "\n".join(made)


def _prose(text: str) -> str:
    return f"{text.strip()}\n".replace("``", "`")


def _items(content: str) -> str:
    """Entries of a section, one of a list each."""
    entries = re.findall(r"^(\S[^\n]*)\n((?:(?:    [^\n]*)?\n|    [^\n]*$)*)", content.rstrip() + "\n", re.MULTILINE)
    lines = []
    for head, body in entries:
        name, _, kind = head.partition(" : ")
        described = " ".join(textwrap.dedent(body).split()).replace("``", "`")
        lines.append(f"- `{name}`{f' ({kind})' if kind else ''}: {described}\n")
    return "".join(lines)
