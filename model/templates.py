"""Generated texts: from Jinja templates, which lie beside the module that fills them, and what comments can hold.

Jinja is loaded when the first text is written: most commands write none, and start sooner without it.
"""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def render(package: str | tuple[str, ...], template: str, **values: Any) -> str:
    """Fill a template.

    Values are escaped in templates whose names end in ``.html.jinja``, and only there.

    Parameters
    ----------
    package : str or tuple of str
        Package in whose folder the template lies, such as ``"sosmith.gen.report"``; or packages to look in, one after
        the other.
    template : str
        Name of the file.
    **values
        What the template names.

    Raises
    ------
    jinja2.UndefinedError
        If the template names something that is not given.
    """
    packages = (package,) if isinstance(package, str) else package
    return _environment(packages).get_template(template).render(values)


@cache
def _environment(packages: tuple[str, ...]) -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    folders = [files(package) for package in packages]

    def text(name: str) -> str | None:
        places = (folder.joinpath(name) for folder in folders)
        return next((place.read_text(encoding="utf-8") for place in places if place.is_file()), None)

    return Environment(
        loader=FunctionLoader(text),
        autoescape=lambda name: name is not None and name.endswith(".html.jinja"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


_SPELLED = str.maketrans(
    {
        "\N{DEGREE SIGN}": "deg",
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        "\N{OHM SIGN}": "Ohm",
        "\N{GREEK CAPITAL LETTER OMEGA}": "Ohm",
        "\N{MIDDLE DOT}": "*",
        "\N{DOT OPERATOR}": "*",
        "\N{MULTIPLICATION SIGN}": "*",
        "\N{SQUARE ROOT}": "sqrt ",
        "\N{PER MILLE SIGN}": "permille",
        "\N{MINUS SIGN}": "-",
    }
)

_POWER = re.compile(r"[⁺⁻⁰¹²³⁴-⁹]+")


def in_ascii(text: str) -> str:
    """Return a text in printable ASCII: units spelled out, accents left off, ``?`` for any other character.

    >>> in_ascii("0.198 µm"), in_ascii("°C"), in_ascii("kΩ"), in_ascii("m·s⁻²"), in_ascii("é"), in_ascii("米")
    ('0.198 um', 'degC', 'kOhm', 'm*s^-2', 'e', '?')
    """
    marked = _POWER.sub(lambda power: f"^{power[0]}", text).translate(_SPELLED)
    plain = unicodedata.normalize("NFKD", marked).replace("\N{MINUS SIGN}", "-")
    return "".join(c for c in plain if not unicodedata.combining(c)).encode("ascii", "replace").decode("ascii")


def in_comment(text: str) -> str:
    """Return a text in ASCII that neither begins nor ends a comment.

    >>> in_comment("N*/m²")
    'N* /m^2'
    """
    return in_ascii(text).replace("*/", "* /").replace("/*", "/ *")
