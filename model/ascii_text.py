"""Text for comments in files that must be ASCII: units as engineers write them where there is no other letter."""

from __future__ import annotations

import re
import unicodedata

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
