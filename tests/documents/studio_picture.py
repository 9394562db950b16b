"""Renews the pictures of the studio in docs/studio.md: a filter with a mask, and a chain, in a headless Chromium.

python -m tests.documents.studio_picture
"""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

from tests.host.browser import Tab, browser

from sosmith.studio.server import Studio
from sosmith.studio.session import opened

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "images"
FILTER = ROOT / "examples" / "audio_lowpass.toml"
CHAIN = ROOT / "examples" / "recipes" / "receiver.toml"
WIDTH, SCALE = 1180, 1.5
MASK = {
    "filter.family": "elliptic",
    "filter.passband_edge": 1000.0,
    "filter.stopband_edge": 2000.0,
    "filter.passband_loss": 1.0,
    "filter.stopband_loss": 50.0,
}
PROVEN = "document.getElementById('state').textContent.startsWith('Proven')"


def main() -> None:
    """Open an example with a mask and a chain, take a picture of each and write it."""
    with tempfile.TemporaryDirectory() as made, browser(Path(made) / "profile") as tab:
        session = opened(FILTER, None, Path(made))
        with Studio(session) as studio:
            session.handle({"do": "change", "changes": MASK}, "picture")
            taken(tab, studio, "#tiles", "studio.png")
        with Studio(opened(CHAIN, None, Path(made))) as studio:
            taken(tab, studio, "#gain", "studio_chain.png")


def taken(tab: Tab, studio: Studio, last: str, name: str) -> None:
    """Take a picture of the page down to an element, with the last stage of a chain shown."""
    tab.window(WIDTH, 900)
    tab.open(studio.address)
    tab.until(f"document.readyState === 'complete' && document.getElementById('state') && {PROVEN}")
    tab.value("document.querySelector('#stages li:last-child .pick')?.click()")
    tab.until("document.querySelectorAll('.handle').length === 2")
    height = tab.value(f"document.querySelector({last!r}).getBoundingClientRect().bottom") + 24
    clip = {"x": 0, "y": 0, "width": WIDTH, "height": height, "scale": SCALE}
    shown = tab.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
    (PICTURES / name).write_bytes(base64.b64decode(shown["data"]))


if __name__ == "__main__":
    main()
