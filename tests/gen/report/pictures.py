"""Reports whose pictures are empty, for tests of what else is on the page: drawing takes most of a report's time."""

from typing import Any, TextIO
from unittest.mock import patch

from matplotlib.figure import Figure


def _empty(_figure: Figure, stream: TextIO, **_options: Any) -> None:
    stream.write("<svg>\n</svg>\n")


without_pictures = patch.object(Figure, "savefig", _empty)
"""Decorates a test, or opens a block."""
