"""What the site adds to docs/: README, CHANGELOG and executed notebooks, links only to what it has, a search on disk.

It also mends what axe-core finds in the pages of the theme.

A hook of MkDocs, named in mkdocs.yml.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

import gallery
import nbformat
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {"index.md": "README.md", "changelog.md": "CHANGELOG.md"}
"""Pages of the site by the files beside docs/ that they show."""

_LINK = re.compile(r"(?P<image>!?)\[(?P<text>[^\]]*)\]\((?P<target>[^)#\s]+)(?P<anchor>#[^)]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that stand beside docs/."""
    for page, source in PAGES.items():
        files.append(File.generated(config, page, abs_src_path=str(ROOT / source)))
    for path in gallery.notebooks():
        _add_notebook(path, files, config)
    return files


def _add_notebook(path: Path, files: Files, config: Any) -> None:
    """Put an executed notebook in the place of the one without outputs, its page and its pictures beside it."""
    folder = f"{path.parent.name}/"
    notebook = gallery.executed(path)
    text, pictures = gallery.page(notebook, path.stem)
    files.remove(files.src_uris[folder + path.name])
    made = {path.name: nbformat.writes(notebook), f"{path.stem}.md": text, **pictures}
    for name, content in made.items():
        files.append(File.generated(config, folder + name, content=content))


def on_page_markdown(markdown: str, page: Any, files: Files, **_: Any) -> str:
    """Let links point to pages of the site; what it does not have is named without a link."""
    source = PAGES.get(page.file.src_uri, f"docs/{page.file.src_uri}")

    def linked(link: re.Match[str]) -> str:
        if "://" in link["target"]:
            return link[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link["target"]))
        uri = next((name for name, file in PAGES.items() if file == path), path.removeprefix("docs/"))
        if not path.startswith("docs/") and path not in PAGES.values():
            return link["text"]
        target = posixpath.relpath(uri, posixpath.dirname(page.file.src_uri) or ".")
        return f"{link['image']}[{link['text']}]({target}{link['anchor'] or ''})"

    return _LINK.sub(linked, markdown)


_MENDED = (
    # What belongs to no landmark is skipped by whoever goes from one to the next.
    (
        re.compile(r'<div class="rst-versions" role="note" aria-label="Versions">'),
        '<nav class="rst-versions" aria-label="Pages">',
    ),
    (re.compile(r"(</span>\s*)</div>(?=\s*<script)"), r"\1</nav>"),
    (re.compile(r"<footer>"), '<footer role="contentinfo">'),
    (re.compile(r'<div role="contentinfo">'), "<div>"),
    # What is wider than a phone scrolls, and has to with the keys alone.
    (re.compile(r"<(pre><code|table)\b"), r'<\1 tabindex="0"'),
)
"""What is written otherwise than in the theme."""


def on_post_page(output: str, **_: Any) -> str:
    """Let a page be read with a screen reader and with the keys alone."""
    for pattern, text in _MENDED:
        output = pattern.sub(text, output)
    return output


def on_post_template(output_content: str, **_: Any) -> str:
    """Do the same for the pages that have no source: that of results, and the one for a wrong address."""
    return on_post_page(output_content)


def on_post_build(config: Any) -> None:
    """Have the search need no server: its index becomes a script, and `search.js` looks into it."""
    search = Path(config["site_dir"]) / "search"
    index = search / "search_index.json"
    (search / "search_index.js").write_text(f"sosmithSearch = {index.read_text(encoding='utf-8')};\n", encoding="utf-8")
    for replaced in (index, search / "worker.js"):
        replaced.unlink()
    (search / "main.js").write_text((ROOT / "docs" / "search.js").read_text(encoding="utf-8"), encoding="utf-8")
