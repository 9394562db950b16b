"""The page of a comparison in a real browser: it fits the window, says nothing on the console and asks for nothing."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.gen.report.test_comparison import WORSE, report

from sosmith.gen.report.comparison.baseline import judge
from sosmith.gen.report.comparison.page import comparison_page

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

PROBE = """<script>
addEventListener("load", () => {
  const wide = document.documentElement.scrollWidth, asked = performance.getEntriesByType("resource").length;
  document.title = `probe ${wide - innerWidth} ${asked} ${document.querySelectorAll("svg").length}`;
});
</script>"""


@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium on this machine")
@pytest.mark.parametrize("width", [500, 1200])
def test_page_in_a_browser(width: int, tmp_path: Path) -> None:
    assert BROWSER is not None
    reports = [report(), report(**WORSE, name="another_design_with_a_long_name")]
    page = comparison_page(reports, judge(reports[0], reports[1:]))
    (tmp_path / "page.html").write_text(page.replace("</head>", PROBE + "</head>"), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom"]
    found = subprocess.run(
        [
            BROWSER,
            *options,
            f"--user-data-dir={tmp_path / 'profile'}",
            f"--window-size={width},900",
            (tmp_path / "page.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    title = re.search(r"<title>probe (-?\d+) (\d+) (\d+)</title>", found.stdout)
    assert title is not None
    beyond, asked, drawings = map(int, title.groups())
    assert (beyond <= 0, asked, drawings) == (True, 0, 9)
    assert "CONSOLE" not in found.stderr
