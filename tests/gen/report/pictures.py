"""Reports whose pictures are empty, for tests of what else is on the page: drawing takes most of a report's time."""

from unittest.mock import patch

without_pictures = patch("sosmith.gen.report.plots.svg_text", lambda _figure: "<svg>\n</svg>\n")
"""Decorates a test, or opens a block."""
