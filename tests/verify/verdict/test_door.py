"""What the verifier takes as said by whom: wrong items, manifests and files whose digests are all right."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.verify.small_specifications import STEADY, STEADY_INSTRUMENT

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generate
from sosmith.gen.specification.specification import load
from sosmith.interface.certificate import Certificate, Proof
from sosmith.verify.certificate_file import Certificate as Entries
from sosmith.verify.certificate_file import certificate_text, sealed
from sosmith.verify.graph import RejectedError
from sosmith.verify.verdict import door, generated_files
from sosmith.verify.verdict.scope import State

Tree = dict[str, Any]
MEASURED = (
    STEADY_INSTRUMENT.replace(
        "calibration.coefficients = [[1.16, -0.0036], [0.3672, 0.0006618], [0.05812]]", 'calibration.data = "m.csv"'
    )
    + "wear = { initial = 1.0, warning = 2.5, limit = 3.0 }\n"
)
"""A calibration from the measurements in a file beside it, and limits of wear."""

PARALLEL = STEADY + 'hardware.architecture = "parallel"\n'
FOLDED = STEADY + 'hardware.architecture = "folded"\n'


def measured(further: float) -> str:
    """Measurements of a sensor that is `further` mm away."""
    points = [(v, t) for v in (1.5, 3.25, 4.5, 6.0, 8.5) for t in (20.0, 41.5, 60.0, 97.0)]
    rows = [f"{round(1.2 + further + 0.4 * v + 0.001 * v * t, 4)},{v},{t}\n" for v, t in points]
    return "clearance_mm,voltage_V,temperature_C\n" + "".join(rows)


@pytest.fixture(scope="module")
def cores(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str | None], Path]:
    known: dict[tuple[str, str | None], Path] = {}

    def written(text: str, core: str | None = None) -> Path:
        if (text, core) not in known:
            folder = known[text, core] = tmp_path_factory.mktemp("core")
            spec = folder / "spec.toml"
            spec.write_text(text, encoding="utf-8")
            (folder / "m.csv").write_text(measured(0.0), encoding="utf-8")
            generate(design_core(load(spec), core=core), folder)
        return known[text, core]

    return written


@pytest.fixture
def copy(cores: Callable[[str, str | None], Path], tmp_path: Path) -> Callable[..., Path]:
    def copied(text: str, core: str | None = None) -> Path:
        return Path(shutil.copytree(cores(text, core), tmp_path / "copy"))

    return copied


def forge(folder: Path, edit: Callable[[Tree], None] = lambda tree: None) -> Path:
    """Change a certificate, and make all digests right again."""
    (path,) = folder.glob("*.certificate.json")
    tree = json.loads(path.read_text(encoding="utf-8"))
    edit(tree)
    about = tree["about"]
    for entry in about["files"]:
        with_name = folder / entry["name"]
        if with_name.exists():
            entry["sha256"] = hashlib.sha256(with_name.read_bytes()).hexdigest()
    about["sha256"] = hashlib.sha256(about["specification"].encode()).hexdigest()
    path.write_text(certificate_text(sealed(Entries.model_validate(tree))), encoding="utf-8")
    return path


def changed(folder: Path, name: str, old: str, new: str) -> None:
    path = folder / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def proof(path: Path, *, spec: bool = False, core: str | None = None) -> Proof:
    stated = path.parent / "spec.toml" if spec else None
    return Certificate.load(path).verify(spec=stated, files=path.parent, core=core)


def item(**fields: Any) -> Callable[[Tree], None]:
    return lambda tree: tree["about"]["item"].update(fields)


def test_what_is_right_is_proven_as_a_whole(copy: Callable[..., Path]) -> None:
    found = proof(forge(copy(PARALLEL)), spec=True)
    assert found.hardware is not None
    assert not found.missing
    assert found.scope["hardware"].state is found.scope["filter"].state is State.PROVEN


@pytest.mark.parametrize("manifest", ["", '"reload": {"x": 1}', '"protect": "detect"'])
def test_an_empty_module_is_no_core(manifest: str, copy: Callable[..., Path]) -> None:
    folder = copy(PARALLEL)
    empty = "module plain(aclk);\n  input aclk;\n  wire aclk;\nendmodule\n"
    (folder / "plain.sv").write_text(empty, encoding="utf-8")
    if manifest:
        key = manifest.partition(":")[0]
        content = re.sub(rf"{key}: [^,\n]+", manifest, (folder / "plain.json").read_text(encoding="utf-8"), count=1)
        (folder / "plain.json").write_text(content, encoding="utf-8")
    with pytest.raises(RejectedError, match=r"^the port aresetn must be there$"):
        proof(forge(folder))
    with pytest.raises(RejectedError, match=r"^the port aresetn must be there$"):
        proof(forge(folder, item(protect="detect")))


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"channels": 2}, "dest_width of taken of the item must be 8, .*"),
        ({"samples": 2}, "width of taken of the item must be 16, .*"),
        ({"core": "instrument"}, "core of the item must be filter, as in the certificate, not instrument"),
        ({"start": "zero"}, "start of the item must be steady, as in the certificate, not zero"),
        ({"hold": True}, "hold of the item must not be stated without a decimator"),
        ({"ahead": "parallel"}, "ahead of the item must not be there, as in the certificate"),
        ({"architecture": "online"}, "architecture of the item must not be online, as in the certificate"),
        ({"flags": {"input_at_rail": 3}}, "flags of the item must be .*"),
        ({"reload": True}, "the files of the certificate must be plain.sv, .*plain_registers.h, plain.rdl, not .*"),
    ],
)
def test_the_item_agrees_with_what_is_proven(fields: Tree, sentence: str, copy: Callable[..., Path]) -> None:
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        proof(forge(copy(PARALLEL), item(**fields)))


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("channels = 3", "channels of the item must be 3, as specified, not 1"),
        ('hardware.protect = "detect"', "protect of the item must be detect, as specified, not none"),
        ("hardware.reload = true", "reload of the item must be True, as specified, not False"),
        ("hardware.samples_per_clock = 2", "samples of the item must be 2, as specified, not 1"),
        ('hardware.architecture = "serial"', "architecture of the item must be serial, as specified, not folded"),
    ],
)
def test_the_specification_says_what_the_item_is(key: str, sentence: str, copy: Callable[..., Path]) -> None:
    """The text in the certificate is that of the other specification: nothing but the item disagrees."""
    folder = copy(STEADY)
    wanted = f"{key}\n{STEADY}" if key.startswith("channels") else f"{STEADY}{key}\n"
    (folder / "spec.toml").write_text(wanted, encoding="utf-8")
    stated = re.sub(r"not folded$", "not (folded|parallel)", sentence)
    with pytest.raises(RejectedError, match=f"^{stated}$"):
        proof(forge(folder, lambda tree: tree["about"].update(specification=wanted)), spec=True)


def test_a_certificate_without_the_filter_is_not_one_with_it(copy: Callable[..., Path]) -> None:
    folder = copy(STEADY_INSTRUMENT, "calibration")
    (path,) = folder.glob("*.certificate.json")
    found = proof(path, spec=True)
    assert found.missing["filter"].why == "the certificate is that of a core without the filter"
    assert "filter" not in proof(path, spec=True, core="calibration").missing
    with pytest.raises(RejectedError, match=r"^the core must be instrument, as asked for, not calibration$"):
        proof(path, spec=True, core="instrument")


@pytest.mark.parametrize("missing", ["plain.sv", "plain.c", "plain.il", "plain.json", ".."])
def test_the_set_of_files_is_the_expected_one(missing: str, copy: Callable[..., Path]) -> None:
    def without(tree: Tree) -> None:
        files = tree["about"]["files"]
        tree["about"]["files"] = [entry for entry in files if entry["name"] != missing][
            : None if missing != ".." else 0
        ]

    with pytest.raises(RejectedError, match=r"^the files of the certificate must be plain.sv, .*plain.h, not "):
        proof(forge(copy(PARALLEL), without))


def turned(*place: str) -> Callable[[Tree], None]:
    """Return an edit that turns the order of a list or an object."""

    def edit(tree: Tree) -> None:
        for key in place[:-1]:
            tree = tree[key]
        found = tree[place[-1]]
        tree[place[-1]] = found[::-1] if isinstance(found, list) else dict(reversed(found.items()))

    return edit


def about(key: str, **fields: str) -> Callable[[Tree], None]:
    return lambda tree: tree["about"][key].update(fields)


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (turned("about", "files"), "the files of the certificate must be plain.sv, .*, not plain.h, .*"),
        (turned("about", "item", "flags"), "flags of the item must be .*"),
        (turned("about", "versions"), "the versions in the certificate must be of sosmith, amaranth, .*"),
        (
            turned("claims", "budget"),
            "the parts of the budget must be filter coefficients, .*",
        ),
        (about("versions", proof="audited"), "the versions in the certificate must be of sosmith, amaranth, .*"),
        (about("versions", amaranth="the best"), "the version of amaranth must be a plain one, not 'the best'"),
        (about("versions", amaranth="0.5\n1"), r"the version of amaranth must be a plain one, not '0\.5\\n1'"),
        (about("versions", amaranth="\u0663.1"), "the version of amaranth must be a plain one, not .*"),
        (about("versions", amaranth=""), "the version of amaranth must be a plain one, not ''"),
        (lambda tree: tree["about"]["versions"].pop("amaranth"), "the versions in the certificate must be of .*"),
        (about("options", approved="yes"), "the options in the certificate must be of core, .*, not .*"),
        (about("options", core="instrument"), "core of the item must be filter, .*, not instrument|core of .*"),
        (about("options", board="../x"), r"the option board must be a plain name, not '\.\./x'"),
        (about("options", board="x", core="filter"), "the options in the certificate must be of core, .*"),
    ],
)
def test_nothing_is_free_that_nothing_is_proven_of(
    edit: Callable[[Tree], None], sentence: str, copy: Callable[..., Path]
) -> None:
    with pytest.raises(RejectedError, match=f"^({sentence})$"):
        proof(forge(copy(PARALLEL), edit))


def test_each_file_is_read_once(copy: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """What has the digest is what is proven, though the file be another one a moment later."""
    path, read = forge(copy(PARALLEL)), []

    def once(given: Path, *, links: bool) -> bytes:
        assert not links
        read.append(given.name)
        content = given.read_bytes()
        given.write_bytes(b"changed")
        return content

    monkeypatch.setattr(generated_files, "content_of", once)
    assert not proof(path).missing
    assert sorted(read) == ["plain.c", "plain.h", "plain.il", "plain.json", "plain.sv"]


@pytest.mark.parametrize("name", ["../plain", "/plain", "plain/../plain", "a b", "\x1b[2K", ""])
def test_a_name_is_a_plain_identifier(name: str, copy: Callable[..., Path]) -> None:
    folder = copy(PARALLEL)

    def renamed(tree: Tree) -> None:
        tree["name"] = name
        for entry in tree["about"]["files"]:
            entry["name"] = entry["name"].replace("plain", name)

    with pytest.raises(RejectedError):
        proof(forge(folder, renamed))


@pytest.mark.parametrize(("name", "old", "new"), [("plain.c", " >> 10", " >> 11"), ("plain.h", "int32_t s0", "int s0")])
def test_the_c_model_is_read(name: str, old: str, new: str, copy: Callable[..., Path]) -> None:
    folder = copy(PARALLEL)
    changed(folder, name, old, new)
    with pytest.raises(RejectedError, match=r"of the C model must compute|of plain.h must go on with"):
        proof(forge(folder))


def test_the_rtlil_is_compared_with_the_systemverilog(copy: Callable[..., Path]) -> None:
    folder = copy(PARALLEL)
    changed(folder, "plain.il", "cell $and ", "cell $or ")
    with pytest.raises(RejectedError, match=r"must be the same in the RTLIL as in the SystemVerilog$"):
        proof(forge(folder))


def test_an_old_certificate_proves_no_hardware(copy: Callable[..., Path]) -> None:
    found = proof(forge(copy(PARALLEL), lambda tree: tree["about"].pop("item")), spec=True)
    assert found.hardware is None
    assert found.missing["hardware"].why == "the certificate does not state what the item is"
    assert found.missing["filter"].state is State.PARTIAL


@pytest.mark.parametrize("words", ["[", "a = 1\na = 2", "[wear", "x = " + "[" * 5000, "filter = 1\n[wear", "\x00"])
def test_broken_words_are_a_sentence(words: str, copy: Callable[..., Path]) -> None:
    path = forge(copy(PARALLEL), lambda tree: tree["about"].update(specification=words))
    with pytest.raises(RejectedError, match=r"^the specification must be TOML$"):
        proof(path)


@pytest.mark.slow
def test_a_calibration_is_fitted_again(copy: Callable[..., Path]) -> None:
    folder = copy(MEASURED, "calibration")
    (path,) = folder.glob("*.certificate.json")
    found = proof(path, spec=True, core="calibration")
    assert found.scope["calibration"].state is State.PROVEN
    assert found.agreement is not None
    assert found.agreement.measurements == 20

    def other(tree: Tree) -> None:
        content = measured(0.4)
        (folder / "m.csv").write_text(content, encoding="utf-8")
        tree["about"]["measurements"]["sha256"] = hashlib.sha256(content.encode()).hexdigest()

    with pytest.raises(
        RejectedError, match=r"^coefficient \[0\]\[0\] .* must be 1\.34\d*, as fitted .*, not 0\.94\d*$"
    ):
        proof(forge(folder, other), spec=True)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"wear": [[897, 1025]]}, r"wear of the item must be \(\(896, 1024\),\), as specified, not .*"),
        ({"wear": []}, r"wear of the item must be \(\(896, 1024\),\), as specified, not \(\)"),
        (
            {"wear": [[896, 1024], [896, 1024]]},
            "wear of the item must be that of all .* each of 1, not of 2",
        ),
        ({"wear": [[1024, 896]]}, "wear of the item must be codes of the output that rise, not 1024 and 896"),
        ({"calibrated": []}, r"(calibrated of the item must be .*, as specified|the program must judge .*), not .*"),
        ({"calibrated": [[0, 5000], [0, 9]]}, r"calibrated of the item must be codes of voltage, not 0\.\.5000"),
        ({"calibrated": [[0, 5]]}, "calibrated of the item must have codes of each input"),
    ],
)
def test_what_is_flagged_is_what_is_specified(fields: Tree, sentence: str, copy: Callable[..., Path]) -> None:
    with pytest.raises(RejectedError, match=f"^{sentence}$"):
        proof(forge(copy(MEASURED, "calibration"), item(**fields)), spec=True)


def test_words_that_nothing_is_held_against_are_named(copy: Callable[..., Path]) -> None:
    text = PARALLEL + 'hardware.realization = "df1"\nhardware.clock = 1000000\nhardware.pipeline = "auto"\n'
    agreement = proof(next(copy(text).glob("*.certificate.json")), spec=True).agreement
    assert agreement is not None
    assert agreement.not_compared == ("hardware.realization", "hardware.clock")


def test_each_step_is_announced_before_its_work(copy: Callable[..., Path]) -> None:
    (path,) = copy(FOLDED).glob("*.certificate.json")
    steps: list[tuple[str, int, int]] = []
    spec = path.parent / "spec.toml"
    Certificate.load(path).verify(spec=spec, files=path.parent, progress=lambda *step: steps.append(step))
    named = ("specification", "files", "manifest", "program", "unit", "C model", "RTLIL")
    assert [step for step in steps if step[0] in named] == [(name, 0, 0) for name in named]


@pytest.mark.parametrize(("architecture", "serial"), [("folded", False), ("serial", True)])
def test_a_unit_is_proven_as_what_the_item_says(
    architecture: str, serial: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    kinds: list[bool] = []
    for name in ("check_program", "behind_decimator", "at_lower_rate", "_calibrated", "_ahead"):
        monkeypatch.setattr(door, name, lambda *arguments, **keys: None)
    monkeypatch.setattr(door, "check_unit", lambda text, certificate, serial: kinds.append(serial))
    certificate: Any = SimpleNamespace(decimation=None, downsampling=None)
    stated: Any = SimpleNamespace(architecture=architecture, protect="none", reload=False)
    door._hardware_proven(certificate, stated, "", lambda *step: None)
    assert kinds == [serial]
