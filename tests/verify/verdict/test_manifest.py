"""A manifest against its certificate: each field is what the certificate says, or is named as not held."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.gen.word_lengths.decimated import small
from tests.verify.small_specifications import INSTRUMENT, PLAIN, STEADY

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generated
from sosmith.gen.specification.specification import from_text
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.check import HardwareVerdict
from sosmith.verify.program.check import ProgramVerdict, check_program
from sosmith.verify.progress import Progress
from sosmith.verify.unit.check import UnitVerdict
from sosmith.verify.unit.going_on import Pace
from sosmith.verify.verdict import manifest
from sosmith.verify.verdict.item import check_item
from sosmith.verify.verdict.manifest import Manifest, read_manifest

Tree = dict[str, Any]

FIXED = 'hardware.realization = "df1_ef1"\n'
TEXTS = {
    "parallel": PLAIN.replace("sample_rate", "channels = 2\nsample_rate", 1)
    + FIXED
    + 'hardware.architecture = "parallel"\n',
    "folded": STEADY + FIXED + 'hardware.architecture = "folded"\n',
    "worn": INSTRUMENT
    + FIXED
    + "wear = { initial = 1.0, warning = 2.5, limit = 3.0 }\n"
    + 'hardware.architecture = "folded"\nhardware.reload = true\n',
}


class Core:
    """The certificate and the manifest of a core."""

    def __init__(self, texts: dict[str, str]) -> None:
        (text,) = (text for name, text in texts.items() if name.endswith(".certificate.json"))
        self.certificate = Certificate.model_validate(json.loads(text))
        self.manifest = texts[f"{self.certificate.name}.json"]
        self.source = texts[f"{self.certificate.name}.sv"]

    def read(self, text: str) -> Manifest:
        about = self.certificate.about
        assert about is not None
        assert about.item is not None
        return read_manifest(text.encode(), self.certificate, about.item)

    def changed(self, path: str, value: Any) -> str:
        """Return the manifest with another value at a path such as ``streams.s_axis.fields.0.lsb``."""
        tree = json.loads(self.manifest)
        place = tree
        *way, last = [int(key) if key.lstrip("-").isdigit() else key for key in path.split(".")]
        for key in way:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value(place[last]) if callable(value) else value
        return json.dumps(tree)


@pytest.fixture(scope="module")
def core() -> Callable[[str], Core]:
    known: dict[str, Core] = {}

    def of(name: str) -> Core:
        if name not in known:
            made = small() if name == "decimated" else design_core(from_text(TEXTS[name], Path("spec.toml")))
            known[name] = Core(generated(made))
        return known[name]

    return of


RELOAD = {f"reload.{key}" for key in ("interface", "design", "words", "word_bits", "restarts")}
AHEAD = {f"decimation.calibration.{key}" for key in ("cycles_per_sample", "latency_cycles", "instructions")}
AROUND = {f"decimation.{key}" for key in ("deviation_db", "delay", "cycles_per_result", "direct_largest_db")}


@pytest.mark.sweep(2)
@pytest.mark.parametrize(
    ("name", "unheld"), [("parallel", set()), ("folded", set()), ("worn", RELOAD), ("decimated", AROUND | AHEAD)]
)
def test_what_is_held_against_nothing_is_named(name: str, unheld: set[str], core: Callable[[str], Core]) -> None:
    read = core(name).read(core(name).manifest)
    assert set(read.open) == unheld


@pytest.mark.parametrize(
    ("name", "path", "value", "sentence"),
    [
        ("folded", "name", "other", "name in the manifest must be plain, as in the certificate, not other"),
        ("folded", "core", "instrument", "core in the manifest must be filter, .*, not instrument"),
        ("folded", "sosmith_version", "9", "sosmith_version in the manifest must be .*, not 9"),
        ("folded", "spec.sample_rate", 50.0, "spec.sample_rate in the manifest must be 100.0, .*, not 50.0"),
        ("folded", "spec.filter.order", 3, "spec.filter.order in the manifest must be 2, .*, not 3"),
        ("folded", "spec.more", 3, "spec in the manifest must not have more"),
        ("folded", "channels", 2, "channels in the manifest must be 1, .*, not 2"),
        ("folded", "channels", True, "channels in the manifest must be 1, .*, not True"),
        ("parallel", "streams.s_axis.tdest.width", 16, r"streams.s_axis.tdest.width .* must be 8, .*, not 16"),
        ("folded", "streams.s_axis.width", 16, "streams.s_axis.width in the manifest must be 8, .*, not 16"),
        ("folded", "streams.s_axis.fields.0.offset", 1, r"streams.s_axis.fields\[0\].offset .* must be 0, .*, not 1"),
        ("folded", "streams.s_axis.fields.0.lsb", 0.0078126, r"streams.s_axis.fields\[0\].lsb .* 0.0078125, .*"),
        ("folded", "streams.s_axis.fields.0.signed", 1, r"streams.s_axis.fields\[0\].signed .* be True, .*, not 1"),
        ("folded", "streams.s_axis.fields.0.unit", "V", r"streams.s_axis.fields\[0\].unit .* must be , .*, not V"),
        ("folded", "streams.m_axis.tuser.flags.fault", 5, "streams.m_axis.tuser.flags.fault .* must be 6, .*, not 5"),
        ("folded", "streams.m_axis.samples", 2, "streams.m_axis in the manifest must not have samples"),
        ("folded", "wear", [], r"wear in the manifest must be None, .*, not \[\]"),
        ("worn", "wear.0.warning", 3.6, r"wear\[0\].warning in the manifest must be 3.5, .*, not 3.6"),
        ("worn", "wear.0.codes.1", 1025, r"wear\[0\].codes\[1\] in the manifest must be 1024, .*, not 1025"),
        ("folded", "start", "zero", "start in the manifest must be steady, .*, not zero"),
        ("parallel", "settling.samples", 3, r"settling.samples in the manifest must be \d+, .*, not 3"),
        ("parallel", "settling.seconds", 3.0, "settling.seconds in the manifest must be .*, not 3.0"),
        ("folded", "settling", {}, "settling in the manifest must be None, .*, not {}"),
        ("folded", "architecture", "parallel", "architecture in the manifest must be folded, .*, not parallel"),
        ("folded", "schedule", lambda found: None, "the manifest must have a schedule"),
        ("parallel", "schedule", {}, "the manifest must not have a schedule"),
        ("folded", "reload", {"x": 1}, "reload in the manifest must be None, as in the certificate, not .*"),
        ("worn", "reload.registers.0", "x.h", r"reload.registers\[0\] in the manifest must be .*_registers.h, .*"),
        ("folded", "protect", "detect", "protect in the manifest must be none, .*, not detect"),
        ("folded", "realization", "df1_ef2", "realization in the manifest must be df1_ef1, .*, not df1_ef2"),
        ("folded", "realization", "normal", "realization in the manifest must be that of the sections .*, not normal"),
        ("folded", "realization", ["df1"], "realization in the manifest must be that of the sections .*, not .*"),
        ("folded", "pipeline", "look-ahead", "pipeline in the manifest must be None, .*, not look-ahead"),
        ("folded", "reasons", {"df1_ef1": "a word"}, "the manifest must not have the field reasons"),
        ("folded", "sections.0.name", "section7", r"sections\[0\].name in the manifest must be section0, .*"),
        ("folded", "sections.0.coefficients.0.integer", 7, r"sections\[0\].coefficients\[0\].integer .*, not 7"),
        ("folded", "sections.0.a.1", 0.5, r"sections\[0\].a\[1\] in the manifest must be .*, not 0.5"),
        ("folded", "sections.0.b.0", lambda b: b * (1 + 1e-12), r"sections\[0\].b\[0\] .*"),
        ("folded", "sections.0.output", "Q7.1", r"sections\[0\].output in the manifest must be .*, not Q7.1"),
        ("folded", "sections.0.error_feedback.0", 1, r"sections\[0\].error_feedback\[0\] .* be 0, .*, not 1"),
        ("folded", "sections.0.error_feedback", None, r"sections\[0\] in the manifest must have error_feedback"),
        ("folded", "sections", lambda found: found * 2, "sections in the manifest must have 1 entries, not 2"),
        ("folded", "limit_cycles.0.section", "section7", r"limit_cycles\[0\].section .* section0, .*, not section7"),
        ("folded", "limit_cycles.0.largest", lambda value: value * 0.999, r"limit_cycles\[0\].largest .*"),
        ("folded", "limit_cycles.0.dead_band", 0.0, r"limit_cycles\[0\].dead_band in the manifest must be .*, not 0.0"),
        ("folded", "limit_cycles.0.none", True, r"limit_cycles\[0\].none in the manifest must be False, .*, not True"),
        ("folded", "limit_cycles.0.lyapunov", ["1", "1"], r"limit_cycles\[0\].lyapunov\[1\] .* be \d+/\d+, .*, not 1"),
        ("folded", "limit_cycles", [], "limit_cycles in the manifest must have 1 entries, not 0"),
        ("folded", "formats.2.format", "Q1.1", r"formats\[2\].format in the manifest must be .*, not Q1.1"),
        ("folded", "formats.2.high", 7.5, r"formats\[2\].high in the manifest must be .*, not 7.5"),
        ("folded", "formats.0", None, r"formats in the manifest must have \d+ entries, not \d+"),
        ("folded", "error_bound", lambda found: found * 0.999, "error_bound in the manifest must be .*"),
        ("folded", "error_bound", 1.0, "error_bound in the manifest must be .*, not 1.0"),
        ("folded", "error_bound_proven", 1, "error_bound_proven in the manifest must be True, .*, not 1"),
        ("folded", "error_parts.output rounding", 0.0, "error_parts.output rounding in the manifest must be .*"),
        ("folded", "error_parts.filter rounding", None, "error_parts in the manifest must have filter rounding"),
        ("folded", "error_unit", "mm", "error_unit in the manifest must be , .*, not mm"),
        ("folded", "decimation", {}, "the manifest must not have a decimation, as in the certificate"),
        ("decimated", "decimation.factor", 8, "decimation.factor in the manifest must be 4, .*, not 8"),
        ("decimated", "decimation.held", True, "decimation.held in the manifest must be False, .*, not True"),
        ("decimated", "decimation.sample_rate", 9.0, "decimation.sample_rate in the manifest must be .*, not 9.0"),
        ("decimated", "decimation.aliasing.0.gain_db", -300.0, r"decimation.aliasing\[0\].gain_db .*, not -300.0"),
        ("decimated", "decimation.aliasing.0.low", 0.5, r"decimation.aliasing\[0\].low in the manifest .*, not 0.5"),
        ("decimated", "decimation.largest", 0.0, "decimation.largest in the manifest must be .*, not 0.0"),
        ("folded", "more", 1, "the manifest must not have the field more"),
        ("folded", "formats", None, "the manifest must be that of a core, not another file"),
    ],
)  # fmt: skip
def test_a_field_that_does_not_follow_is_refused(
    name: str, path: str, value: Any, sentence: str, core: Callable[[str], Core]
) -> None:
    text = core(name).changed(path, value)
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        core(name).read(text)


@pytest.mark.parametrize("text", ["", "[]", "3", "{}", "[" * 100_000, '{"channels": 1e400}', '{"channels": NaN}'])
def test_what_is_no_manifest_is_refused(text: str, core: Callable[[str], Core]) -> None:
    with pytest.raises(RejectedError, match=r"^the manifest must be that of a core, not another file$"):
        core("folded").read(text)


def test_a_key_is_there_once(core: Callable[[str], Core]) -> None:
    text = core("folded").manifest.replace('"core"', '"name": "plain",\n  "core"', 1)
    with pytest.raises(RejectedError, match=r"^a key of the manifest must be there once$"):
        core("folded").read(text)


@pytest.mark.parametrize(("key", "clocks"), [("reset_cycles", 1), ("latency_cycles", 1), ("cycles_per_sample", 1)])
def test_clocks_are_those_that_are_proven(key: str, clocks: int, core: Callable[[str], Core]) -> None:
    parallel = core("parallel")
    tree = parallel.read(parallel.manifest).tree
    found = HardwareVerdict(20, 2, 4, tree["latency_cycles"], 2, tree["reset_cycles"])
    read = parallel.read(parallel.manifest)
    read.hold_clocks(found)
    assert key not in read.open
    with pytest.raises(RejectedError, match=rf"^{key} in the manifest must be \d+, .*$"):
        parallel.read(parallel.changed(key, lambda right: right + clocks)).hold_clocks(found)
    read.hold_clocks(None)
    assert key in read.open


@pytest.mark.parametrize("key", ["reset_cycles", "latency_cycles", "cycles_per_sample"])
def test_clocks_are_those_of_a_proven_unit(key: str, core: Callable[[str], Core]) -> None:
    """A sample is taken some clocks after it is found, which the clocks after a reset count too."""
    folded = core("folded")
    tree = folded.read(folded.manifest).tree
    progress = Progress(23, tree["latency_cycles"] - 4, tree["reset_cycles"] - 4)
    found = UnitVerdict(90, 35, Pace(progress, tree["latency_cycles"], tree["cycles_per_sample"], 4))
    read = folded.read(folded.manifest)
    read.hold_clocks(found)
    assert key not in read.open
    with pytest.raises(RejectedError, match=rf"^{key} in the manifest must be {tree[key]}, .*, not {tree[key] + 1}$"):
        folded.read(folded.changed(key, lambda right: right + 1)).hold_clocks(found)


@pytest.fixture(scope="module")
def program(core: Callable[[str], Core]) -> ProgramVerdict:
    folded = core("folded")
    return check_program(folded.source, folded.certificate)


def test_the_schedule_is_held(core: Callable[[str], Core], program: ProgramVerdict) -> None:
    folded = core("folded")
    read = folded.read(folded.manifest)
    read.hold_program(program)
    assert read.open == []
    read.hold_program(None)
    assert read.open == ["schedule"]


_PLACE = "schedule.places of the manifest must say where"
_MISSING = "schedule.places of the manifest must have"


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("digit_bits", 77, "schedule.digit_bits in the manifest must be 15, .*, not 77"),
        ("accumulator_bits", 77, "schedule.accumulator_bits in the manifest must be .*, not 77"),
        ("words", 77, "schedule.words in the manifest must be 16, .*, not 77"),
        ("states", 77, "schedule.states in the manifest must be 8, .*, not 77"),
        ("instructions.3.2", 77, r"schedule.instructions\[3\]\[2\] in the manifest must be .*, not 77"),
        ("more", 77, "schedule in the manifest must not have more"),
        ("places.0.name", "section0.x", f"{_PLACE} section0.x is"),
        ("places.0.name", ["x"], "schedule.places in the manifest must be places of words"),
        ("places.0.addresses.0", 5, f"{_PLACE} .* is"),
        ("places.0.addresses", [], f"{_PLACE} .* is"),
        ("places.0.frac", lambda frac: frac + 1, f"{_PLACE} .* is"),
        ("places.0.state", False, f"{_PLACE} .* is"),
        ("places.0.more", 1, f"{_PLACE} .* is"),
        ("places.-1.name", "section0.nothing", f"{_PLACE} section0.nothing is"),
        ("places.-1.frac", lambda frac: frac + 1, f"{_PLACE} .* is"),
        ("places.-1.state", True, f"{_PLACE} .* is"),
        ("places.0", None, f"{_MISSING} .*"),
        ("places.3", None, f"{_MISSING} the words .*"),
        ("places", lambda places: [*places, places[0]], "each place in the manifest must have a name of its own"),
        ("places", 3, "schedule.places in the manifest must be places of words"),
    ],
)
def test_another_schedule_is_refused(
    path: str, value: Any, sentence: str, core: Callable[[str], Core], program: ProgramVerdict
) -> None:
    folded = core("folded")
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        folded.read(folded.changed(f"schedule.{path}", value)).hold_program(program)


def test_several_samples_a_clock_are_those_of_one_channel(core: Callable[[str], Core]) -> None:
    about = core("parallel").certificate.about
    assert about is not None
    assert about.item is not None
    wrong = about.item.model_copy(update={"samples": 2})
    with pytest.raises(RejectedError, match=r"^several samples a clock must be those of one channel$"):
        check_item(core("parallel").certificate, wrong)


def test_wear_that_the_specification_does_not_have_is_refused(core: Callable[[str], Core]) -> None:
    about = core("parallel").certificate.about
    assert about is not None
    assert about.item is not None
    wrong = about.item.model_copy(update={"wear": ((1, 2), (1, 2))})
    with pytest.raises(RejectedError, match=r"^the manifest must be that of a core, not another file$"):
        read_manifest(core("parallel").manifest.encode(), core("parallel").certificate, wrong)


def test_without_a_rate_no_time_to_settle_is_held(core: Callable[[str], Core]) -> None:
    certificate = core("parallel").certificate
    about = certificate.about
    assert about is not None
    assert about.item is not None
    assert certificate.claims.settling
    assert manifest._specified(certificate, about.item)["settling"] is not None
    words = "\n".join(line for line in about.specification.splitlines() if not line.startswith("sample_rate"))
    other = certificate.model_copy(update={"about": about.model_copy(update={"specification": words})})
    assert manifest._specified(other, about.item)["settling"] is None
