"""Netlists that Yosys makes of texts, one start of it for all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from sosmith.gen.fpga.yosys import run_yosys
from sosmith.verify.reader.outside import SCRIPT


def netlists(texts: Sequence[str], top: str) -> list[str]:
    """Return the netlist of each text in JSON; all have the same top."""
    with TemporaryDirectory() as folder:
        script = []
        for number, text in enumerate(texts):
            (Path(folder) / f"core{number}.sv").write_text(text, encoding="ascii")
            own = SCRIPT.format(top=top).replace("core.", f"core{number}.")
            script.append(f"design -reset; {own}")
        run_yosys("; ".join(script), Path(folder))
        return [(Path(folder) / f"core{k}.json").read_text(encoding="utf-8") for k in range(len(texts))]
