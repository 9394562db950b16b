"""The table [filter]: valid TOML whatever the comments hold, put into a specification and nothing else touched."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

from sosmith.gen.specification.specification import example
from sosmith.instrument.spectrum.filter_table import filter_table, replace_filter
from sosmith.instrument.spectrum.prediction import Content
from sosmith.instrument.spectrum.proposal import Proposal, propose
from sosmith.instrument.spectrum.settings import SpectrumSettings, Wish
from sosmith.instrument.spectrum.spectra import spectrum
from sosmith.model.errors import SpecificationError

TABLE = '[filter]\nfamily = "butterworth"\norder = 2\n'


def proposal() -> Proposal:
    noise = np.random.default_rng(1).normal(0, 0.2, 4000)
    found = spectrum(noise, 100.0, SpectrumSettings())
    return propose([Content(name="m", wanted=None, disturbance=found, has_truth=False)], Wish(passband=0.5), 100.0)


def test_the_table_holds_the_numbers_that_were_used() -> None:
    made = proposal()
    text = filter_table(made, ["trace.csv (sha256 00)", "a name\nwith = 'a line break'"])
    assert tomllib.loads(text)["filter"] == {
        "family": "butterworth",
        "kind": "lowpass",
        "method": "bilinear",
        **{choice.key: choice.value for choice in made.choices},
    }
    assert "# trace.csv (sha256 00)\n# a name?with = 'a line break'\n" in text


def test_only_the_table_changes() -> None:
    before = example()
    after = replace_filter(before, TABLE, "my.toml")
    start, stop = before.index("[filter]"), before.index("\n[output]")
    assert after == before[:start] + TABLE + before[stop:]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[filter]\norder = 1", TABLE),
        ("[filter]\norder = 1\n# of the filter\n[b]\n", f"{TABLE}\n[b]\n"),
        ("[a]\nx = 1\n[filter] # old\norder = 1\n[b]\n", f"[a]\nx = 1\n{TABLE}\n[b]\n"),
        ("[filter]\nsos = [\n[1, 2],\n  [3, 4],\n]\n# mine\n\n# of b\n[b]\n", f"{TABLE}\n# of b\n[b]\n"),
        (
            '[a]\nx = """\n[filter]\n"""\n[ filter ]\r\norder = 1\n\n[[b]]\n',
            f'[a]\nx = """\n[filter]\n"""\n{TABLE}\n[[b]]\n',
        ),
        ('[filter]\nx = """\n[b]\n"""\n[filter.more]\ny = 2\n[c]\n', f"{TABLE}\n[c]\n"),
    ],
)
def test_other_forms(before: str, after: str) -> None:
    assert replace_filter(before, TABLE, "my.toml") == after


@pytest.mark.parametrize("text", ["a = 1\n", "filter = { order = 1 }\n", "filter.order = 1\n"])
def test_refusals(text: str) -> None:
    message = "my.toml: filter must be a table under a line [filter] of its own, to be replaced"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        replace_filter(text, TABLE, "my.toml")
