"""Renews the picture of the studio in docs/studio.md: an example with a mask, shown in a headless Chromium.

python -m tests.documents.studio_picture
"""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

from tests.host.browser import browser

from sosmith.studio.server import Studio
from sosmith.studio.session import opened

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "images" / "studio.png"
EXAMPLE = ROOT / "examples" / "audio_lowpass.toml"
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
    """Open the example, give it a mask, take the picture and write it."""
    with tempfile.TemporaryDirectory() as made, browser(Path(made) / "profile") as tab:
        session = opened(EXAMPLE, None, Path(made))
        with Studio(session) as studio:
            session.handle({"do": "change", "changes": MASK}, "picture")
            tab.window(WIDTH, 900)
            tab.open(studio.address)
            tab.until(f"document.querySelectorAll('.handle').length === 2 && {PROVEN}")
            height = tab.value("document.getElementById('tiles').getBoundingClientRect().bottom") + 24
            clip = {"x": 0, "y": 0, "width": WIDTH, "height": height, "scale": SCALE}
            shown = tab.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
    PICTURE.write_bytes(base64.b64decode(shown["data"]))


if __name__ == "__main__":
    main()
