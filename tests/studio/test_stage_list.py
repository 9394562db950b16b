"""The list of stages in the text of a specification: comments go along, and new stages suit their places."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest
from tests.gen.chain.chains import PLAIN, instrument
from tests.house import ROOT
from tests.interface.small import FILTER

from sosmith import ChainSpecification, Specification
from sosmith.studio.edits import changed
from sosmith.studio.stage_list import added, chosen, moved, removed, split, stages_of
from sosmith.studio.tables import cut

RECEIVER = (ROOT / "examples/recipes/receiver.toml").read_text(encoding="utf-8")
INTERPOLATOR = (ROOT / "examples/recipes/interpolator.toml").read_text(encoding="utf-8")
COMMENTED = """\
name = "rx"
sample_rate = 8000
# not a table: [[stage]]
[input.x]
bits = 8
range = [
  -1.0,
  1.0]
signed = true

# first
# of two
[[stage]]  # averages
name = "slow"
kind = "cic"
order = 2
decimate = 2

[[stage]]
name = "out"
kind = "fir"
taps = [
  0.5, # [[stage]]
  0.5
]

# the rest
[output]
bits = 10
range = [-1.0, 1.0]
signed = true
"""


def names(text: str) -> list[str]:
    """Return the names of the stages."""
    return [stage["name"] for stage in stages_of(text) or ()]


def test_a_stage_moves_with_its_comments_and_back() -> None:
    for text in (RECEIVER, COMMENTED):
        assert "".join(piece.text + piece.blank for piece in cut(text)) == text
        there = moved(text, 0, 1)
        assert names(there) == [names(text)[1], names(text)[0], *names(text)[2:]]
        assert sorted(there.splitlines()) == sorted(text.splitlines())
        assert moved(there, 1, 0) == text
    made = moved(COMMENTED, 1, 0)
    assert "]\n\n# first\n# of two\n[[stage]]  # averages\nname" in made
    assert made.startswith(COMMENTED[: COMMENTED.index("# first")])
    assert made.endswith(COMMENTED[COMMENTED.index("# the rest") :])


def test_a_stage_is_removed_and_nothing_else() -> None:
    made = removed(COMMENTED, 0)
    assert made == COMMENTED[: COMMENTED.index("# first")] + COMMENTED[COMMENTED.index('[[stage]]\nname = "out"') :]
    empty = removed(made, 0)
    assert names(empty) == []
    assert names(added(empty, "auto", 0)) == ["auto"]
    assert removed(empty, 0) == empty
    assert stages_of("name = ") is None
    assert removed("name = ", 0) == added("name = ", "fir", 0) == "name = "


def test_stages_on_one_line_become_tables() -> None:
    line = 'stage = [{name = "a", kind = "gain", factor = 2.0}, {name = "b", kind = "fir", taps = [0.5, 0.5]}]\n'
    text = COMMENTED.replace("sample_rate", f"{line}sample_rate")
    head, _, rest = text.partition("# first")
    made = moved(head + rest[rest.index("# the rest") :], 0, 1)
    assert [list(stage.values()) for stage in stages_of(made) or ()] == [["b", "fir", [0.5, 0.5]], ["a", "gain", 2.0]]
    assert made.index("[[stage]]") < made.index("[output]")
    assert ChainSpecification.from_toml(made).stages == ("b", "a")


@pytest.mark.parametrize("kind", ["gain", "iir", "fir", "halfband", "cic"])
@pytest.mark.parametrize("text", [RECEIVER, INTERPOLATOR], ids=["down", "up"])
def test_a_new_stage_suits_every_place(text: str, kind: str) -> None:
    for k in range(4):
        made = added(text, kind, k)
        spec = ChainSpecification.from_toml(made)
        assert [stage["kind"] for stage in stages_of(made) or ()][k] == kind
        assert spec.stages[:k] + spec.stages[k + 1 :] == tuple(names(text))
        assert spec.alone[k].filter.order >= 0  # it can be designed
        assert spec.factor % 32 == 0 if text is RECEIVER else spec.factor == 1  # the others change the rate as before


@pytest.mark.parametrize("kind", ["gain", "iir", "fir", "halfband", "cic"])
def test_a_stage_gets_another_kind(kind: str) -> None:
    for text, places in ((RECEIVER, (1, 2)), (INTERPOLATOR, (0, 1, 2))):
        for k in places:
            made = changed(text, {f"stage.{k}.kind": kind})
            assert ChainSpecification.from_toml(made).alone[k].filter.order >= 0  # it can be designed
            table = (stages_of(made) or [])[k]
            assert (table["name"], table["kind"]) == (names(text)[k], kind)
            if text is RECEIVER and kind != "gain":
                assert table["decimate"] == 2  # the stages behind it find their rate


def stage_after(table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a stage after changes; the chain with it must be accepted."""
    tree = {**PLAIN, "stage": [{"name": "a", **table}, {"name": "b", "kind": "gain", "factor": 1.0}]}
    text = ChainSpecification.load(tree).toml()
    made = changed(text, {f"stage.0.{key}": value for key, value in changes.items()})
    ChainSpecification.from_toml(made)
    return {key: value for key, value in tomllib.loads(made)["stage"][0].items() if key not in {"name", "kind"}}


def test_a_form_takes_the_place_of_another() -> None:
    edges = {"passband_edge": 800.0, "stopband_edge": 1600.0, "passband_loss": 0.1, "stopband_loss": 60.0}
    mean = {"kind": "fir", "taps": [0.5, 0.5]}
    assert stage_after(mean, {"family": "kaiser"}) == {"family": "kaiser", **edges}
    assert stage_after({"kind": "fir", **edges}, {"taps": [1.0, 1.0]}) == {"taps": [1.0, 1.0]}
    assert stage_after({"kind": "cic", "order": 2, "decimate": 4}, {"interpolate": 2}) == {"order": 2, "interpolate": 2}
    high = stage_after({"kind": "fir", **edges}, {"band": "highpass"})
    assert high == {**edges, "band": "highpass", "stopband_edge": 400.0}
    low = {"kind": "iir", "family": "butterworth", "order": 2, "cutoff": 800.0}
    masked = stage_after(low, {"passband_edge": 700.0, "stopband_edge": 1500.0})
    losses = {"passband_loss": 1.0, "stopband_loss": 40.0}
    assert masked == {"family": "butterworth", "passband_edge": 700.0, "stopband_edge": 1500.0, **losses}


def test_a_single_core_is_split_into_stages() -> None:
    text = (ROOT / "examples/audio_lowpass.toml").read_text(encoding="utf-8")
    made = split(text)
    assert ChainSpecification.from_toml(made).stages == ("filter",)
    assert made.replace('[[stage]]\nname = "filter"\nkind = "iir"\n', "[filter]\n").replace("band =", "kind =") in {
        text,
        text.replace('realization = "auto"\n', ""),
    }
    gauge = {key: value for key, value in instrument().items() if key != "stage"}
    gauge |= {"calibration": {"coefficients": [[0.0], [1.0]]}, "filter": FILTER["filter"] | {"cutoff": 9.0}}
    both = split(Specification.load(gauge | {"hardware": {"realization": "df1"}}).toml())
    assert names(both) == ["calibration", "filter"]
    assert [stage["kind"] for stage in stages_of(both) or ()] == ["polynomial", "iir"]
    assert ChainSpecification.from_toml(both).as_dict()["stage"][1]["realization"] == "df1"
    assert split(both) == both


def test_chosen_stages_are_written_with_their_limits() -> None:
    limits = {"passband_edge": 100.0, "passband_loss": 0.5, "stopband_loss": 40.0}
    auto = {"name": "down", "kind": "auto", "decimate": 4, **limits}
    text = "# mine\n" + ChainSpecification.load({**PLAIN, "stage": [auto]}).toml()
    made = chosen(text, PLAIN["stage"], limits)
    spec = ChainSpecification.from_toml(made).as_dict()
    assert (spec["stage"], spec["limits"]) == (PLAIN["stage"], limits)
    assert made.startswith("# mine\n")
