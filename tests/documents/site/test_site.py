"""The site of the documentation: it builds without a warning, and its pages take nothing from elsewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tests.documents.shown import ROOT
from tests.host.browser import BROWSER, browser

_STYLE = re.compile(r"""url\(\s*["']?([^"')]+)|@import\s+["']([^"']+)""")
_LOADING = {"script": "src", "img": "src", "source": "src", "iframe": "src", "object": "data", "link": "href"}
"""What makes a browser load something, by element; links that a reader follows do not."""


class Loaded(HTMLParser):
    """Collects the addresses that a page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if given.get("rel") != "canonical":
            self.addresses += [address for address in [given.get(_LOADING.get(tag, ""))] if address]


def loaded(path: Path) -> list[str]:
    """Addresses that a page or a style sheet makes a browser load."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".css":
        return ["".join(found) for found in _STYLE.findall(text)]
    page = Loaded()
    page.feed(text)
    return page.addresses


def missing(site: Path) -> list[str]:
    """Addresses in `site` that are not files of it, with the file that asks for them."""
    files = [path for path in sorted(site.rglob("*")) if path.suffix in {".html", ".css"} and path.name != "404.html"]
    return [
        f"{path.relative_to(site)}: {address}"
        for path in files
        for address in loaded(path)
        if not address.startswith("data:") and not (path.parent / re.split("[?#]", address)[0]).is_file()
    ]


def test_what_a_page_takes_from_elsewhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<link rel="stylesheet" href="own.css?1"><script src="https://x.org/a.js"></script>'
        '<img src="//x.org/a.png"><a href="https://x.org">'
    )
    (tmp_path / "own.css").write_text("@import 'https://x.org/b.css'; @font-face { src: url(https://x.org/c.woff) }")
    assert missing(tmp_path) == [
        "a.html: https://x.org/a.js",
        "a.html: //x.org/a.png",
        "own.css: https://x.org/b.css",
        "own.css: https://x.org/c.woff",
    ]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site, without a warning; return its folder."""
    pytest.importorskip("mkdocs", reason="mkdocs is missing: pip install 'sosmith[docs]'")
    folder = tmp_path_factory.mktemp("built") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "WARNING" not in result.stderr
    return folder


@pytest.mark.slow
def test_the_site_stands_alone(site: Path) -> None:
    pages = {path.relative_to(ROOT / "docs").with_suffix("").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    built = {path.relative_to(site).with_suffix("").as_posix() for path in site.rglob("*.html")}
    assert pages - {"recipes/README"} | {"index", "changelog", "recipes/index"} <= built
    assert missing(site) == []


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
def test_the_search_works_from_a_disk(site: Path, tmp_path: Path) -> None:
    """From a page in a folder, by the beginning of a word, to a link that is there; and with nothing to find."""
    titles = "[...document.querySelectorAll('#mkdocs-search-results a')].map(link => link.textContent)"
    with browser(tmp_path / "profile") as tab:
        tab.open((site / "recipes" / "notch.html").as_uri())
        tab.until("document.readyState === 'complete' && document.querySelector('#rtd-search-form') !== null")
        tab.value("document.querySelector('#rtd-search-form input').value = 'back-pressure'")
        tab.value("document.querySelector('#rtd-search-form').submit()")
        tab.until("document.querySelectorAll('#mkdocs-search-results a').length > 0")
        assert tab.value("document.getElementById('mkdocs-search-query').value") == "back-pressure"
        address = tab.value("document.querySelector('#mkdocs-search-results a').href")
        assert (site / address.removeprefix(site.as_uri() + "/").partition("#")[0]).is_file()
        typed = "query => { const f = document.getElementById('mkdocs-search-query'); f.value = query;"
        typed += " f.dispatchEvent(new Event('input')); }"
        tab.value(f"({typed})('look-ah')")
        assert "Look-ahead" in tab.value(titles)
        tab.value(f"({typed})('xyzzyqq')")
        assert tab.value("document.getElementById('mkdocs-search-results').textContent") == "No results found"
        assert tab.said == []


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_a_page_can_be_read_by_everyone(site: Path, tmp_path: Path, width: int, dark: bool) -> None:
    """By the rules of axe-core, and without a page that is wider than the screen."""
    pages = [path for path in sorted(site.rglob("*.html")) if path.name != "404.html"]  # its addresses need a server
    found: list[str] = []
    with browser(tmp_path / "profile") as tab:
        for page in pages:
            tab.show(page, width, dark=dark)
            inside = tab.value("document.documentElement.scrollWidth <= innerWidth")
            found += [f"{page.relative_to(site)}: {fault}" for fault in tab.faults() + ["too wide"] * (not inside)]
    assert len(pages) > 40
    assert found == []
