"""Reports whose pictures are empty, for tests of something else: drawing takes most of a report's time.

Each decorates a test, or opens a block.
"""

from unittest.mock import patch

_EMPTY = "<svg>\n</svg>\n"

without_pictures = patch("sosmith.gen.report.figures.painting.svg_text", lambda _figure: _EMPTY)
"""Pictures are painted, but not laid out and written."""

unpainted = patch("sosmith.gen.report.figures.painting._painted", lambda *_: _EMPTY)
"""Nor are they painted: for tests that do not look at a page."""
