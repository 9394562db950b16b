"""The rooms that are mutated, and the tests that belong to each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, kw_only=True)
class Room:
    """Files that are mutated together.

    Attributes
    ----------
    files : tuple of str
        Patterns from the root of the checkout.
    tests : tuple of str
        Folders, files and single tests, from the root; slow ones in them are left out.
    without : tuple of str
        Tests that are left out, by the beginning of their identifiers: they repeat on many cases what others do on few,
        or look at something else.
    whole_messages : tuple of str
        Files that do nothing but word messages; they are not mutated.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]
    without: tuple[str, ...] = ()
    whole_messages: tuple[str, ...] = ()

    def paths(self, root: Path) -> list[str]:
        """List the files, sorted, relative to `root`."""
        found = {path.relative_to(root).as_posix() for pattern in self.files for path in root.glob(pattern)}
        return sorted(name for name in found if not name.endswith("__init__.py"))

    def mutated(self, root: Path) -> list[str]:
        """List the files of `paths` that are mutated."""
        return [name for name in self.paths(root) if name not in self.whole_messages]

    def entries(self, root: Path) -> list[str]:
        """List the files of tests below the folders of `tests`, and what else stands there, in order."""
        found: list[str] = []
        for name in self.tests:
            files = sorted((root / name).rglob("test_*.py")) if (root / name).is_dir() else []
            found += [path.relative_to(root).as_posix() for path in files] or [name]
        return found

    def test_files(self, root: Path) -> list[str]:
        """List the files of the tests, sorted."""
        return sorted({name.partition("::")[0] for name in self.entries(root)})


_CERTIFICATE = "tests/verify/test_certificate.py::"
_WHOLE_CERTIFICATES = tuple(
    _CERTIFICATE + name
    for name in (
        "test_examples_in_every_realization[audio",
        "test_one_unit_off",
        "test_designs",
        "test_the_command",
        "test_verification_has_nothing_in_common",
    )
)
_VERIFY = (
    *(f"tests/verify/test_{name}.py" for name in ("calibration_ahead", "certificate", "online", "start", "turns")),
    "tests/verify/multirate/test_decimation.py",
)
_PROGRAM = "tests/verify/program/test_check.py::"
_SPECIFIED = "tests/verify/specified/"
_REPORT = "tests/gen/report/test_report.py::"
_HDL = (
    "tests/hdl/stages/test_stage.py::test_stages_equal_their_graphs[flange_wear_locomotive",
    "tests/hdl/stages/test_stage.py::test_stages_equal_their_graphs[audio",
    "tests/hdl/test_reload.py::test_a_broken_port_is_noticed",
)

ROOMS = {
    "proof": Room(
        files=("gen/proof/*.py",),
        tests=(
            "tests/gen/proof",
            "tests/gen/reload/test_transient.py",
            "tests/gen/word_lengths/test_settling.py",
            f"{_CERTIFICATE}test_a_range_too_narrow_for_what_is_possible",
        ),
        without=(
            "tests/gen/proof/test_limit_cycles.py::test_error_feedback",
            "tests/gen/proof/test_limit_cycles.py::test_plain",
            "tests/gen/proof/test_limit_cycles.py::test_exhaustive_search_stays_within_the_bound",
            "tests/gen/proof/test_limit_cycles.py::test_the_manifest",
            "tests/gen/proof/test_limit_cycles.py::test_design_shows",
        ),
    ),
    "verifier": Room(
        files=("verify/*.py", "verify/parallel/*.py", "verify/specified/*.py"),
        tests=(
            "tests/verify/parallel",
            "tests/verify/specified",
            "tests/verify/multirate/test_start_from_zero.py",
            *_VERIFY,
            "tests/verify/verdict/test_generated_files.py",
            "tests/verify/bounds/test_piecewise.py",
        ),
        without=(
            *_WHOLE_CERTIFICATES,
            f"{_SPECIFIED}test_filter_distance.py::test_the_generators_filter",
            f"{_SPECIFIED}test_filter_distance.py::test_every_word_counts",
        ),
    ),
    "bounds": Room(
        files=("verify/bounds/*.py",),
        tests=("tests/verify/bounds", *_VERIFY),
        without=_WHOLE_CERTIFICATES,
    ),
    "program": Room(
        files=("verify/program/*.py",),
        tests=(
            "tests/verify/program",
            "tests/verify/test_start.py::test_programs",
            "tests/verify/bounds/test_settling.py::test_hardware_that_flags_one_sample_less_is_found",
            "tests/verify/verdict/test_manifest.py::test_another_schedule_is_refused",
        ),
        without=(
            f"{_PROGRAM}test_examples",
            f"{_PROGRAM}test_every_realization[instrument",
            f"{_PROGRAM}test_a_hundred_edits",
            f"{_PROGRAM}test_channels_have_one_program",
        ),
        whole_messages=("verify/program/fault.py",),
    ),
    "arithmetic": Room(
        files=("model/arithmetic/*.py",),
        tests=("tests/model/arithmetic",),
    ),
    "hdl": Room(
        files=(
            "hdl/[!fi]*.py",
            "hdl/shell/fault_guard.py",
            "hdl/bus/serial_crc.py",
            "hdl/cores/parallel.py",
            "hdl/stages/interleaved.py",
            "hdl/plan/[!fi]*.py",
            "hdl/plan/interleaving.py",
        ),
        tests=("tests/hdl",),
        without=_HDL,
    ),
    "folded": Room(
        files=(
            "hdl/cores/folded*.py",
            "hdl/cores/multiply_accumulate.py",
            "hdl/cores/program_memory.py",
            "hdl/instruction.py",
            "hdl/plan/folded_clocks.py",
            "hdl/plan/instructions.py",
        ),
        tests=("tests/hdl",),
        without=_HDL,
    ),
    "verdict": Room(
        files=(
            "gen/report/report.py",
            "gen/report/evidence.py",
            "gen/report/input_ranges.py",
            "gen/report/mask.py",
            "gen/report/run.py",
            "gen/filter/response.py",
            "model/reference/accuracy.py",
        ),
        tests=(
            "tests/gen/report/test_report.py",
            "tests/gen/report/test_run.py",
            "tests/model/reference/test_accuracy.py",
        ),
        without=tuple(
            _REPORT + name
            for name in (
                "test_a_delay_beyond",
                "test_a_handful",
                "test_a_limit_far",
                "test_a_page",
                "test_close_up",
                "test_every_colour",
                "test_file_holds",
                "test_many_formats",
                "test_page",
                "test_references",
                "test_same_evidence",
                "test_summary_has_the_keys",
                "test_texts",
                "test_thinning",
                "test_this_design",
            )
        ),
    ),
    "door": Room(files=("verify/verdict/*.py",), tests=("tests/verify/verdict",)),
    "reader": Room(files=("verify/reader/**/*.py",), tests=("tests/verify/reader",)),
    "unit": Room(files=("verify/unit/*.py",), tests=("tests/verify/unit",)),
    "multirate": Room(files=("verify/multirate/**/*.py",), tests=("tests/verify/multirate",)),
    "multiplexed": Room(files=("verify/multiplexed/*.py",), tests=("tests/verify/multiplexed",)),
    "chain": Room(files=("verify/chain/*.py",), tests=("tests/verify/chain",)),
    "smt": Room(files=("verify/parallel/smt/*.py",), tests=("tests/verify/parallel/smt",)),
    "c_model": Room(files=("verify/c_model/*.py",), tests=("tests/verify/c_model",)),
    "rocq": Room(files=("verify/rocq/*.py",), tests=("tests/verify/rocq",)),
}
"""Rooms by name. `verdict` holds what decides whether a report says that a run has passed, `door` what decides whether
files are those of a certificate. All that a proof rests on is in one: `tests/documents/test_mutation.py` sees to it."""
