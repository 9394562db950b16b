"""The table of combinations: it says what the rules of a specification and the design do."""

import tomllib
from decimal import Decimal
from itertools import combinations as combinations_of
from pathlib import Path
from typing import Any

import pytest

from sosmith.gen.chain.reading import chain_from_tree
from sosmith.gen.core import design_core
from sosmith.gen.specification.choices import PIPELINES
from sosmith.gen.specification.combinations import CHAIN, OPTIONS, TERMS, Combination, combinations
from sosmith.gen.specification.specification import Specification, from_tree
from sosmith.model.errors import SpecificationError

SMALL = """
name = "smallest"
sample_rate = 100.0
input.x = { bits = 8, signed = true, range = [-1.0, 1.0] }
filter = { family = "butterworth", kind = "lowpass", method = "bilinear", order = 2, cutoff = 10.0 }
output = { bits = 8, signed = true, range = [-1.0, 1.0], unit = "", max_error = 0.02 }
"""
ASKED: dict[str, tuple[str, str, Any]] = {
    "FIR": ("", "filter", {"taps": [Decimal("0.25"), Decimal("0.5"), Decimal("0.25")]}),
    "channels": ("", "channels", 2),
    "reload": ("hardware", "reload", True),
    "protect": ("hardware", "protect", "correct"),
    "decimate": ("filter", "decimate", 2),
    "decimate by FIR": ("", "filter", {"taps": [Decimal("0.25"), Decimal("0.25"), Decimal("0.25")], "decimate": 2}),
    "decimate by CIC": ("", "filter", {"taps": [Decimal("0.25"), Decimal("0.5"), Decimal("0.25")], "decimate": 2}),
    "samples_per_clock": ("hardware", "samples_per_clock", 2),
    "look-ahead": ("hardware", "pipeline", "look-ahead"),
    "start zero": ("hardware", "start", "zero"),
    "multipliers 0": ("hardware", "multipliers", 0),
    "multipliers 1 or more": ("hardware", "multipliers", 1),
}
"""Table, key and value that ask for each option."""


def asking_for(*names: str) -> Specification:
    if names[0] == CHAIN.name:
        return asking_a_chain_for(names[1])
    tree = tomllib.loads(SMALL, parse_float=Decimal)
    for name in names:
        table, key, value = ASKED.get(name, ("hardware", "architecture", name))
        (tree.setdefault(table, {}) if table else tree)[key] = dict(value) if isinstance(value, dict) else value
    return from_tree(tree, Path("small.toml"))


def asking_a_chain_for(option: str) -> Specification:
    """Ask for it in a chain of one stage, whose specification is returned."""
    tree = tomllib.loads(SMALL, parse_float=Decimal)
    table, key, value = ASKED[option]
    filter_ = tree.pop("filter") | (value if key == "filter" else {})
    stage = {"name": "one", "kind": "fir" if "taps" in filter_ else "iir"} | filter_
    for name in ("kind", "family", "method", "order", "cutoff") if "taps" in filter_ else ():
        stage.pop(name, None)
    stage |= {"kind": "fir"} if "taps" in filter_ else {"kind": "iir", "band": "lowpass"}
    if table == "filter":
        stage[key] = value
    elif key != "filter":
        (tree.setdefault(table, {}) if table else tree)[key] = value
    chain = chain_from_tree(tree | {"stage": [stage]}, Path("small.toml"))
    (only,) = chain.stages
    return only.ordinary(chain, chain.base.inputs, chain.base.output)


def test_every_option_and_every_architecture_is_there() -> None:
    assert [option.name for option in OPTIONS] == list(ASKED)
    pairs = {(each.row, each.option) for each in combinations()}
    assert pairs >= {(name, option) for name in (*TERMS, CHAIN.name) for option in ASKED}
    beside = [(one, other) for k, one in enumerate(ASKED) for other in [*ASKED][k + 1 :]]
    decimating = ("decimate", "decimate by FIR", "decimate by CIC")
    same_key = {("multipliers 0", "multipliers 1 or more"), *combinations_of(decimating, 2)}
    assert {pair for pair in beside if pair not in pairs} == same_key


@pytest.mark.sweep(10)
@pytest.mark.parametrize(
    "pair", combinations(), ids=lambda pair: "-".join(filter(None, (pair.row, pair.beside, pair.option)))
)
def test_what_the_table_says_is_what_happens(pair: Combination) -> None:
    if pair.verdict == "ok":
        made = design_core(asking_for(pair.row, pair.option))
        assert pair.row not in TERMS or made.architecture.name == pair.row
        return
    with pytest.raises(SpecificationError) as refused:
        asking_for(*filter(None, (pair.row, pair.beside, pair.option)))
    assert ("not yet available: " in str(refused.value)) == (pair.verdict == "not yet")
    assert pair.reason in str(refused.value)
    assert pair.reason or pair.verdict == "not yet"


def test_what_one_architecture_does_not_take_together_is_there() -> None:
    apart = {(each.row, each.beside, each.option) for each in combinations() if each.beside}
    assert apart == {(name, *(each.name for each in pair)) for name, terms in TERMS.items() for pair in terms.apart}
    assert ("parallel", "reload", "multipliers 0") in apart


@pytest.mark.parametrize("pair", [each for each in combinations() if each.beside], ids=lambda pair: pair.row)
def test_what_it_takes_apart_is_ok(pair: Combination) -> None:
    """Each of the two is taken without the other one."""
    for option in (pair.beside, pair.option):
        assert asking_for(pair.row, option).hardware.architecture == pair.row


def test_a_pipeline_without_look_ahead_is_no_option() -> None:
    """What messages ask for instead of look-ahead is what there is."""
    assert [f"'{name}'" for name in PIPELINES if name != "look-ahead"] == ["'auto'", "'plain'"]
