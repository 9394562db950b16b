"""A design built for a board."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sosmith.gen.estimate.silicon.timing import PACKAGE as STA
from sosmith.gen.facts.table import Table, View
from sosmith.gen.fpga.boards import find_board
from sosmith.gen.output.board_build import BoardBuild
from sosmith.model.errors import ShortfallError, ToolError


@dataclass(frozen=True, eq=False)
class Build(View):
    """The results of `Design.build`.

    Attributes
    ----------
    summary : dict
        The content of ``build.json``.
    folder : Path
        Folder of the files.
    shortfall : str or None
        The clock and the path for which timing does not close; None if it does.
    """

    summary: dict[str, Any] = field(repr=False)
    folder: Path
    shortfall: str | None = field(repr=False)

    @classmethod
    def written(cls, build: BoardBuild, folder: Path) -> Build:
        """Write the files of a build into `folder`, and return their content."""
        build.write(folder)
        return cls(build.summary, folder, None if build.passed else build.shortfall)

    @property
    def passed(self) -> bool:
        """Whether timing closes."""
        return self.shortfall is None

    @property
    def bitstream(self) -> Path:
        """Path of the bitstream.

        Raises
        ------
        ShortfallError
            If timing does not close: there is none then.
        """
        if self.shortfall is not None:
            raise ShortfallError(self.shortfall)
        return self.folder / str(self.summary["bitstream"]["file"])

    @property
    def fmax(self) -> float:
        """Highest frequency in Hz that the placed design takes; that of the slowest clock, if there are several."""
        slowest = min(self.summary["clocks"], key=lambda clock: clock["achieved_mhz"] / clock["wanted_mhz"])
        return float(1e6 * slowest["achieved_mhz"])

    def program(self) -> None:
        """Load the bitstream into the FPGA of a board that is attached, until it loses power.

        Raises
        ------
        ShortfallError
            If timing does not close.
        ToolError
            If openFPGALoader is missing or fails, as it does without a board.
        """
        bitstream, loader = self.bitstream, find_board(self.summary["board"]).loader
        program = shutil.which("openFPGALoader")
        if program is None:
            raise ToolError(
                "openFPGALoader is needed to program a board, and was not found: apt-get install openfpgaloader"
            )
        done = subprocess.run(
            [program, "-b", str(loader), bitstream], capture_output=True, text=True, errors="replace", check=False
        )
        if done.returncode:
            tail = "\n".join((done.stdout + done.stderr).strip().splitlines()[-5:])
            raise ToolError(f"openFPGALoader could not program the {self.summary['title']}:\n{tail}")

    @property
    def table(self) -> Table:
        """What the design takes of the FPGA, and how fast it could run."""
        return build_table(self.summary)

    def tables(self) -> list[Table]:
        """Return `table` alone."""
        return [self.table]

    def __repr__(self) -> str:
        timing = "timing closes" if self.passed else "timing does not close"
        return f"<sosmith.Build {self.summary['name']} on {self.summary['title']}: {timing}, {self.fmax / 1e6:.2f} MHz>"


def build_table(summary: Mapping[str, Any]) -> Table:
    """Say what a design takes of an FPGA, and how fast it could run; `summary` is the content of ``build.json``."""
    rows: list[Sequence[str]] = [("device", summary["device"]), ("architecture", summary["architecture"])]
    for kind, cells in summary.get("utilisation", {}).items():
        if cells["used"]:
            share = 100 * cells["used"] / cells["available"]
            rows.append((kind, f"{cells['used']:,} of {cells['available']:,}, {share:.0f} %"))
    for clock in summary.get("clocks", ()):
        met = "closes" if clock["achieved_mhz"] >= clock["wanted_mhz"] else "does not close"
        needed = f"of which {clock['wanted_mhz']:.2f} MHz are needed"
        rows.append(("timing", f"{met}: {clock['achieved_mhz']:.2f} MHz, {needed}"))
    if "project" in summary:
        rows.append(("timing", f"not known: {summary['project']['tool']} was not run"))
    if "sample_rate" in summary:
        rate = summary["sample_rate"]
        rows.append(("sample rate", f"{rate['hz']:,.2f} Hz: {rate['ppm']:+,.0f} ppm; MCLK {rate['mclk_hz']:,.0f} Hz"))
    rows.append(("serial line", f"{summary['line_rate_baud']:,} baud"))
    return Table(f"{summary['name']} on {summary['title']}", rows)


def silicon_table(name: str, found: Mapping[str, Any]) -> Table:
    """Say what a core takes of silicon; `found` is what `Design.silicon` returns."""
    area, registers = found["area_um2"], found["area_of_registers_um2"]
    clock = f"apt-get install {STA}" if found["clock_hz"] is None else f"{found['clock_hz'] / 1e6:.1f} MHz"
    rows = [
        ("cells", f"{found['title']}; {found['corner']}"),
        ("area", f"{area / 1e6:.4f} mm2, {100 * registers / area:.0f} % of it flip-flops"),
        ("gates", f"{found['nand2_equivalents']:,} NAND2 equivalents"),
        ("clock", f"{'not known: ' * (found['clock_hz'] is None)}{clock}"),
        ("not in it", "wires, clock tree, pads: this is before layout; memories are flip-flops"),
    ]
    return Table(f"{name} on {found['library']}", rows)
