"""The notebooks of the gallery: executed, and made pages of the site.

docs/gallery/ holds them without outputs. `executed` runs one with the kernel of this Python in a folder of its own, and
`page` makes Markdown of it, with its pictures in files beside it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbconvert import MarkdownExporter
from traitlets.config import Config

GALLERY = Path(__file__).parent / "gallery"
SECONDS = 300
"""Time that a cell may take, in s."""


def notebooks() -> list[Path]:
    """Return the paths of the notebooks, by their names."""
    return sorted(GALLERY.glob("*.ipynb"))


def executed(path: Path) -> Any:
    """Run a notebook from its first cell to its last; return it with its outputs.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell ends with an error.
    """
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        # The kernel is talked to by files of the folder, not by ports that others could reach.
        line = {"transport": "ipc", "connection_file": str(Path(folder) / "kernel.json")}
        resources = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=SECONDS, resources=resources, config=Config(KernelManager=line)).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # the times at which it ran
    return notebook


def page(notebook: Any, name: str) -> tuple[str, dict[str, bytes]]:
    """Return the Markdown of an executed notebook, and its pictures by their names."""
    resources = {"unique_key": name, "output_files_dir": "."}
    text, made = MarkdownExporter().from_notebook_node(notebook, resources=resources)
    download = f"\n[This page as a notebook]({name}.ipynb)\n"
    return text + download, {Path(file).name: content for file, content in made["outputs"].items()}
