"""The examples of the package: each has a name and a line about it, and comes with the files that it needs."""

from pathlib import Path

import pytest
from tests.machines.made_files import ROOT

from sosmith.gen.specification import examples, specification
from sosmith.model.errors import SpecificationError

EXAMPLES = ROOT / "examples"


def test_each_example_is_listed_with_a_line_about_it() -> None:
    titles = examples.titles()
    assert {"flange_wear", "audio_lowpass", "scenarios/bench_43_50", "measurements", "all"} < set(titles)
    assert {f"recipes/{path.stem}" for path in (EXAMPLES / "recipes").glob("*.toml")} < set(titles)
    assert all(titles.values())


def test_the_default_is_the_specification_that_explains_every_key() -> None:
    assert examples.contents(examples.DEFAULT) == {Path("flange_wear.toml"): specification.example().encode()}


def test_a_specification_brings_the_files_that_it_names() -> None:
    assert examples.contents("recipes/equalizer", Path("here", "my.toml")) == {
        Path("here", "my.toml"): (EXAMPLES / "recipes" / "equalizer.toml").read_bytes(),
        Path("here", "equalizer.txt"): (EXAMPLES / "recipes" / "equalizer.txt").read_bytes(),
    }


def test_all_is_what_the_documentation_calls_examples() -> None:
    everything = examples.contents("all")
    assert Path("examples", "scenarios", "specifications", "flange_wear_tread_braking.toml") in everything
    for path, content in everything.items():
        assert content == (ROOT / path).read_bytes()


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(SpecificationError, match=r"not 'recipes/equalzer' \(did you mean recipes/equalizer\?\)$"):
        examples.contents("recipes/equalzer")
