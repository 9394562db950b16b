"""Renews the picture of a report in the README: the built-in example, simulated and shown in a headless Chromium.

python -m tests.documents.report_picture
"""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

from tests.host.browser import browser

from sosmith.gen.specification.specification import example
from sosmith.interface.design import design
from sosmith.interface.specification import Specification

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "report.png"
WIDTH, SCALE = 1100, 1.6
LAST_SHOWN = "figure"
"""What the picture ends with: the first figure of the page."""


def main() -> None:
    """Simulate, take the picture, and write it."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        (folder / "flange_wear.toml").write_text(example(), encoding="utf-8")
        report = design(Specification.load(folder / "flange_wear.toml")).simulate(folder=folder / "out")
        with browser(folder / "profile") as tab:
            tab.window(WIDTH, 900)
            tab.open((report.folder / "report.html").as_uri())
            tab.until("document.readyState === 'complete'")
            height = tab.value(f"document.querySelector('{LAST_SHOWN}').getBoundingClientRect().bottom") + 24
            clip = {"x": 0, "y": 0, "width": WIDTH, "height": height, "scale": SCALE}
            shown = tab.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
    PICTURE.write_bytes(base64.b64decode(shown["data"]))


if __name__ == "__main__":
    main()
