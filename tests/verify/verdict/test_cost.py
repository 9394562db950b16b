"""The cost in a manifest: counted again from the graphs and the hardware, whatever is made of adders or not."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from tests.verify.small_specifications import INSTRUMENT, PLAIN, STEADY

from sosmith.gen.core import design_core
from sosmith.gen.output.generate import generated
from sosmith.gen.specification.specification import from_text
from sosmith.verify.certificate_file import Certificate
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.check import check_hardware
from sosmith.verify.verdict.manifest import Manifest, read_manifest
from sosmith.verify.verdict.scope import Proofs

PARALLEL = 'hardware.architecture = "parallel"\nhardware.realization = "REALIZATION"\nhardware.multipliers = COUNT\n'
FIR = """
name = "plain"
sample_rate = 100.0
input.x = { bits = 8, range = [-1.0, 1.0], signed = true }
filter.taps = [0.5, -0.25, 0.3, 0.71, 0.3, 0.125]
output = { bits = 8, range = [-4.0, 4.0], signed = true }
"""


def parallel(text: str, realization: str, count: int, channels: int = 1) -> str:
    text = text.replace("sample_rate", f"channels = {channels}\nsample_rate", 1)
    return text + PARALLEL.replace("REALIZATION", realization).replace("COUNT", str(count))


class Core:
    """A core, with its hardware proven."""

    def __init__(self, text: str) -> None:
        texts = generated(design_core(from_text(text, Path("spec.toml"))))
        (certificate,) = (text for name, text in texts.items() if name.endswith(".certificate.json"))
        self.certificate = Certificate.model_validate(json.loads(certificate))
        self.tree: dict[str, Any] = json.loads(texts[f"{self.certificate.name}.json"])
        self.source = texts[f"{self.certificate.name}.sv"]
        about = self.certificate.about
        assert about is not None
        assert about.item is not None
        self.item = about.item
        self.proofs = Proofs()
        if self.item.architecture == "parallel":
            self.proofs = Proofs(hardware=check_hardware(self.source, self.certificate, self.item.channels))

    def held(self, **changed: Any) -> Manifest:
        """Hold the manifest, with another cost."""
        tree = {**self.tree, "cost": {**self.tree["cost"], **changed}}
        manifest = read_manifest(json.dumps(tree).encode(), self.certificate, self.item)
        manifest.hold_cost(self.certificate, self.item, self.proofs)
        return manifest


@pytest.fixture(scope="module")
def core() -> Callable[[str], Core]:
    return cache(Core)


CASES = [
    (parallel(PLAIN, "df1_ef1", 1), (1, 20)),
    (parallel(PLAIN, "df1_ef1", 0), (0, 60)),
    (parallel(STEADY, "state_space", 2, 5), (2, 100)),
    (parallel(INSTRUMENT, "df1_ef2", 4), (4, 20)),
    (parallel(FIR, "fir_transposed", 1), (1, 10)),
    (parallel(FIR, "fir_direct", 2, 3), (1, 5)),
]


@pytest.mark.sweep(3)
@pytest.mark.parametrize(("text", "least"), CASES)
def test_what_is_stated_is_what_the_hardware_has(
    text: str, least: tuple[int, int], core: Callable[[str], Core]
) -> None:
    own = core(text)
    assert own.held().open == []
    cost = own.tree["cost"]
    assert len(cost["multipliers"]) >= least[0]
    assert cost["adder_bits"] >= least[1]
    for wrong in ({"adder_bits": cost["adder_bits"] + 1}, {"register_bits": cost["register_bits"] - 1}):
        with pytest.raises(RejectedError, match=r"^cost.\w+ in the manifest must be \d+, as in the certificate, not"):
            own.held(**wrong)
    sizes = cost["multipliers"]
    for forged in ([*sizes, [7, 3]], [[99, 3], *sizes[1:]]):
        with pytest.raises(RejectedError, match=r"^cost.multipliers.* in the manifest must .*"):
            own.held(multipliers=forged)


def test_adders_do_not_pass_for_multipliers(core: Callable[[str], Core]) -> None:
    """All products as multipliers, and no sums for them, is the cost of other hardware with the same graphs."""
    blocks, adders = (core(parallel(PLAIN, "df1_ef1", count)) for count in (9, 0))
    assert blocks.held().open == []
    cost = blocks.tree["cost"]
    assert len(cost["multipliers"]) > len(adders.tree["cost"]["multipliers"])
    with pytest.raises(RejectedError, match=r"^cost.multipliers in the manifest must have 0 entries, not \d+$"):
        adders.held(**cost)
    with pytest.raises(RejectedError, match=r"^cost.multipliers in the manifest must have \d+ entries, not 0$"):
        blocks.held(**adders.tree["cost"])


def test_a_product_by_a_power_of_two_may_be_listed_or_not(core: Callable[[str], Core]) -> None:
    """It takes wires, in a multiplier block or out of it."""
    own = core(parallel(FIR, "fir_direct", 9))
    sizes = own.tree["cost"]["multipliers"]
    wires = [index for index, (_, factor) in enumerate(sizes) if factor == 1]
    assert wires
    assert own.held(multipliers=[size for index, size in enumerate(sizes) if index not in wires]).open == []
    with pytest.raises(RejectedError, match=r"^cost.multipliers in the manifest must have \d+ entries, not 0$"):
        own.held(multipliers=[])


def test_a_program_counts_every_product(core: Callable[[str], Core]) -> None:
    own = core(STEADY + 'hardware.architecture = "folded"\nhardware.realization = "df1_ef1"\n')
    assert own.held().open == []
    with pytest.raises(RejectedError, match=r"^cost.multipliers in the manifest must have \d+ entries, not 0$"):
        own.held(multipliers=[])


@pytest.mark.parametrize("wrong", [None, 3, [[1]], "text"])
def test_what_is_no_cost_is_refused(wrong: Any, core: Callable[[str], Core]) -> None:
    with pytest.raises(RejectedError, match=r"^cost.* in the manifest must .*$"):
        core(CASES[0][0]).held(multipliers=wrong)


def test_hardware_that_is_not_read_leaves_it_open(core: Callable[[str], Core]) -> None:
    own = core(CASES[0][0])
    manifest = read_manifest(json.dumps(own.tree).encode(), own.certificate, own.item)
    manifest.hold_cost(own.certificate, own.item, Proofs())
    assert manifest.open == ["cost"]
