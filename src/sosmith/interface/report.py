"""Results of a co-simulation: verdict, figures and samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sosmith.gen.core import CoreDesign
from sosmith.gen.facts.table import Table, View
from sosmith.gen.report.evidence import Evidence
from sosmith.gen.report.headlines import report_table
from sosmith.gen.report.report import write_report
from sosmith.gen.report.run import Run
from sosmith.interface.quantity import Quantity


@dataclass(frozen=True, eq=False)
class Report(View):
    """The results of `Design.simulate`.

    Arrays hold one sample per row, shape (samples,) for one channel and (samples, channels) for several. Times and
    values of the hardware are made when they are asked for: a run may have ten million of them.

    Attributes
    ----------
    summary : dict
        The content of ``report.json``.
    folder : Path
        Folder of the files, including ``report.html``.
    input_codes : dict of str to ndarray of int
        Codes applied to each input.
    unit : str
        Unit of the output.
    """

    summary: dict[str, Any] = field(repr=False)
    folder: Path
    input_codes: dict[str, npt.NDArray[np.int64]] = field(repr=False)
    _run: Run = field(repr=False)
    unit: str

    @classmethod
    def written(cls, design: CoreDesign, evidence: Evidence, folder: Path) -> Report:
        """Write ``report.json`` and ``report.html`` into `folder`, and return their content."""
        run = evidence.run
        codes = run.codes[:, 0] if run.channels == 1 else run.codes
        return cls(
            summary=write_report(evidence, folder),
            folder=folder,
            input_codes={port.name: codes[..., k] for k, port in enumerate(design.datapath.inputs)},
            _run=run,
            unit=evidence.facts.unit,
        )

    @property
    def time(self) -> npt.NDArray[np.float64]:
        """Time of each sample in s, shape (samples,)."""
        return self._run.time

    @property
    def hardware_codes(self) -> npt.NDArray[np.int64]:
        """Codes at the output of the hardware."""
        return np.asarray(self._run.received, dtype=np.int64)

    @property
    def hardware(self) -> npt.NDArray[np.float64]:
        """Output of the hardware, in the unit of the output."""
        return self._run.hardware

    @property
    def exact(self) -> npt.NDArray[np.float64]:
        """The exact result in double precision, in the unit of the output."""
        return np.asarray(self._run.golden)

    @property
    def name(self) -> str:
        """Name of the core."""
        return str(self.summary["name"])

    @property
    def passed(self) -> bool:
        """Whether every sample equals the integer model, and errors and response meet the specification."""
        return bool(self.summary["passed"])

    @property
    def shortfalls(self) -> tuple[str, ...]:
        """Reasons for not passing, one sentence each."""
        return tuple(self.summary["shortfalls"])

    @property
    def bit_exact(self) -> bool:
        """Whether every sample equals the integer model."""
        return bool(self.summary["bit_exact"])

    @property
    def error(self) -> npt.NDArray[np.float64]:
        """Hardware minus exact result, in the unit of the output."""
        return self.hardware - self.exact

    @property
    def largest_error(self) -> Quantity:
        """Largest magnitude of `error`."""
        return Quantity(self.summary["error"]["max_abs"], self.unit)

    @property
    def bound(self) -> Quantity:
        """Proven bound on the error, for all inputs in range."""
        return Quantity(self.summary["error"]["bound"], self.unit)

    @property
    def table(self) -> Table:
        """Verdict, the measurement, the arithmetic and the speed."""
        return report_table(self.summary)

    def tables(self) -> list[Table]:
        """Return `table` alone."""
        return [self.table]

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "falls short"
        return f"<sosmith.Report {self.name}: {verdict}, largest error {self.largest_error} of {self.bound}>"
