"""Libraries of standard cells that Debian has, as data for synthesis."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sosmith.model.errors import SpecificationError, ToolError
from sosmith.model.suggestion import did_you_mean

_PLACE = Path("/usr/share/qflow/tech")
"""Where the Debian packages put them."""


@dataclass(frozen=True, kw_only=True)
class CellLibrary:
    """A library of standard cells.

    Attributes
    ----------
    name : str
        As on the command line.
    title : str
        Name for display.
    corner : str
        Process, voltage and temperature that its delays are those of.
    package : str
        Debian package with its Liberty file.
    nand2 : int
        Area of its smallest NAND of two inputs in um^2: one gate equivalent.
    driver : str
        Cell that drives the inputs while the logic is mapped.
    load : float
        Capacitance of an output in pF, that of some inputs.
    """

    name: str
    title: str
    corner: str
    package: str
    nand2: int
    driver: str = "INVX4"
    load: float = 0.05

    @property
    def path(self) -> Path:
        """Where its Liberty file is."""
        return _PLACE / self.name / f"{self.name}_stdcells.lib"

    def check_installed(self) -> None:
        """Refuse it if it is not installed.

        Raises
        ------
        ToolError
            Says how to install it.
        """
        if not self.path.is_file():
            raise ToolError(f"the cells of {self.name} are needed, and were not found: apt-get install {self.package}")

    @property
    def liberty(self) -> bytes:
        """Its Liberty file.

        Raises
        ------
        ToolError
            As `check_installed`.
        """
        self.check_installed()
        return self.path.read_bytes()


# Areas are those of NAND2X1 in the Liberty files, which are in um^2: the cells are 2.4 by 10 and 4.8 by 20 um.
LIBRARIES = {
    library.name: library
    for library in (
        CellLibrary(
            name="osu018",
            title="OSU standard cells, TSMC 180 nm",
            corner="typical, 1.8 V, 25 degC",
            package="qflow-tech-osu018",
            nand2=24,
        ),
        CellLibrary(
            name="osu035",
            title="OSU standard cells, AMI 350 nm",
            corner="typical, 3.3 V, 25 degC",
            package="qflow-tech-osu035",
            nand2=96,
        ),
    )
}
"""Libraries by name."""


def find_library(name: str) -> CellLibrary:
    """Return a library by its name.

    Raises
    ------
    SpecificationError
        If there is no such library; lists them.
    """
    if name not in LIBRARIES:
        raise SpecificationError(
            f"the standard cells must be one of {', '.join(LIBRARIES)}, not {name}{did_you_mean(name, LIBRARIES)}"
        )
    return LIBRARIES[name]
