"""The flags of a chain: every variant that is written is accepted, and no other."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.gen.chain.chains import GUARDED
from tests.verify.chain.sealing import CERTIFICATE, proven, replace_sealed, sealed_again

import sosmith
from sosmith.gen.chain.joints.flags import FlagsUnit
from sosmith.gen.chain.rates import Pattern
from sosmith.model.errors import ShortfallError
from sosmith.verify.chain.flags import FlagsClaim, Timing, check_flags
from sosmith.verify.reader.source import read_source

VARIANTS = [
    {"carried": carried, "rates": rates, "settling": settling, "channels": channels, "guarded": guarded}
    for carried, rates, settling, channels, guarded in (
        (1, (1, 1, False), 0, 1, ()),
        (2, (1, 2, False), 0, 1, ("low",)),
        (1, (1, 6, False), 1, 1, ()),
        (1, (1, 1, False), 1, 2, ()),
        (2, (1, 4, False), 37, 3, ("low", "other")),
        (1, (1, 64, False), 0, 300, ()),
        (1, (1, 1, False), 0, 5, ("low",)),
        (2, (3, 5, False), 37, 3, ("low", "other")),
        (1, (7, 3, False), 3, 2, ()),
        (2, (4, 2, False), 0, 1, ("low",)),
        (1, (2, 1, False), 2, 1, ()),
        (1, (3, 4, True), 5, 2, ()),
    )
]
_TOKEN = re.compile(r"\d+'h[0-9a-f]+|\b\d+\b|[-+&|~?:]|==|!=|\b[a-z_]\w*\b")
_OTHER = {"-": "+", "+": "-", "&": "|", "|": "&", "==": "!=", "!=": "==", "~": "!"}


def pair(variant: dict[str, Any], depth: int = 8) -> tuple[FlagsUnit, FlagsClaim]:
    rest = {key: value for key, value in variant.items() if key != "rates"}
    unit = FlagsUnit(name="rx_flags", depth=depth, pattern=Pattern(*variant["rates"]), **rest)
    dest = next((width for _, name, width in unit.ports if name == "i_tdest"), 0)
    return unit, FlagsClaim(name="rx_flags", dest=dest, timing=Timing(*variant["rates"]), **rest)


@pytest.mark.parametrize("depth", [2, 16])
@pytest.mark.parametrize("variant", VARIANTS)
def test_each_variant_is_accepted(variant: dict[str, Any], depth: int) -> None:
    unit, claim = pair(variant, depth)
    module = read_source(unit.text(), "rx_flags").modules["rx_flags"]
    assert module.depths["queue"] == depth
    check_flags(module, claim)


@pytest.mark.slow
@pytest.mark.parametrize(
    "variant",
    [
        VARIANTS[4],
        VARIANTS[8],
        *(pytest.param(VARIANTS[k], marks=pytest.mark.slow) for k in (2, 7, 11)),
    ],
)
def test_no_token_may_be_another_one(variant: dict[str, Any]) -> None:
    unit, claim = pair(variant)
    text = unit.text()
    body, refused = text.index("wire reset;"), 0
    for match in _TOKEN.finditer(text, body):
        other = _OTHER.get(match[0], "taken" if match[0] != "taken" else "brings")
        if match[0][0].isdigit():
            other = f"{match[0][:-1]}{(int(match[0][-1], 16) + 1) % 10}"
        changed = text[: match.start()] + other + text[match.end() :]
        with pytest.raises(ShortfallError):
            check_flags(read_source(changed, "rx_flags").modules["rx_flags"], claim)
        refused += 1
    assert refused > 250


@pytest.mark.parametrize("key", ["carried", "rates", "settling", "channels", "guarded"])
def test_flags_of_another_chain_are_refused(key: str) -> None:
    unit, _ = pair(VARIANTS[4])
    changed = VARIANTS[4] | {key: VARIANTS[2][key] if key != "settling" else 38}
    _, claim = pair(changed)
    with pytest.raises(ShortfallError):
        check_flags(read_source(unit.text(), "rx_flags").modules["rx_flags"], claim)


@pytest.mark.parametrize("depth", [3, 1 << 13])
def test_a_queue_of_another_depth_is_refused(depth: int) -> None:
    unit, claim = pair(VARIANTS[0])
    module = read_source(unit.text(), "rx_flags").modules["rx_flags"]
    module.depths["queue"] = depth
    with pytest.raises(
        ShortfallError, match=r"^the queue of rx_flags must have a power of two of entries up to 4096, "
    ):
        check_flags(module, claim)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("flags")
    chain = sosmith.design_chain(GUARDED)
    chain.generate(folder)
    (folder / "rx.toml").write_text(chain.specification.toml(), encoding="utf-8")
    return folder


@pytest.mark.slow
def test_a_chain_from_zero_with_protection_and_registers_is_proven(written: Path) -> None:
    proof = sosmith.ChainCertificate.load(written / CERTIFICATE).verify(files=written, spec=written / "rx.toml")
    whole = {name for name, part in proof.scope.items() if part.state.value == "proven"}
    assert {"chain", "stages", "top", "arithmetic", "filter", "c_model"} <= whole
    assert "hardware with protection against upsets is not proven" in proof.missing["hardware"].why


@pytest.mark.sweep(1)
@pytest.mark.parametrize(
    ("file", "old", "new", "sentence"),
    [
        (
            "rx.sv",
            ".s_axil_awaddr(s_axil_out_awaddr)",
            ".s_axil_awaddr(s_axil_out_araddr)",
            r"^the registers' net s_axil_",
        ),
        (
            "rx.sv",
            ".stage_low_tuser(stage_low_tuser)",
            ".stage_low_tuser(stage_slow_tuser)",
            r"^stage_low_tuser of rx_fl",
        ),
        ("rx.sv", "assign room = spare & open;", "assign room = spare | open;", r"^rx_flags must assign "),
        ("rx.c", "flags |= 32;", "flags |= 64;", r"^rx\.c must have 32 after "),
        (
            "rx.json",
            '"settling_results": ',
            '"settling_results": 1',
            r"^settling_results of the manifest must be \d+, ",
        ),
    ],
)
def test_another_file_is_refused(file: str, old: str, new: str, sentence: str, written: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(written, tmp_path / "copy"))
    replace_sealed(folder / file, old, new)
    with pytest.raises(ShortfallError, match=sentence):
        proven(folder, spec=False)


def test_other_hardware_of_a_stage_than_the_words_ask_for_is_refused(written: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(written, tmp_path / "copy"))
    path = folder / "rx.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in (('start = "zero"', 'start = "steady"'), ('protect = "detect"', 'protect = "correct"')):
        assert old in text
        path.write_text(text.replace(old, new), encoding="utf-8")
        sealed_again(folder, lambda tree: tree.update(specification=path.read_text(encoding="utf-8")))
        with pytest.raises(
            ShortfallError, match=r"^the hardware of stage \w+ must be as the specification of the chain"
        ):
            sosmith.ChainCertificate.load(folder / CERTIFICATE).verify(spec=path)
