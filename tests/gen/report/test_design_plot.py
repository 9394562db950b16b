"""The picture of a design has a panel for each thing that the core does, and is the same on every run."""

import re

import pytest
from tests.gen.designs import example_design

import sosmith
from sosmith.gen.report.design_plot import design_plot


@pytest.mark.slow
@pytest.mark.parametrize(
    ("core", "titles"),
    [
        ("instrument", ["Calibration at each temperature", "Gain", "Group delay"]),
        ("filter", ["Gain", "Group delay"]),
        ("calibration", ["Calibration at each temperature"]),
    ],
)
def test_panels(core: str, titles: list[str]) -> None:
    made = example_design("flange_wear_bench.toml", core=core, realization="df1_ef2").quantized
    drawn = design_plot(made, "svg")
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", drawn.decode())
    assert [text for text in texts if text in ("Gain", "Group delay") or text.startswith("Calibration")] == titles
    assert drawn == design_plot(made, "svg")


def test_a_filter_without_delay_is_drawn_without_a_warning() -> None:
    spec = sosmith.Specification.from_taps([0.5], 100.0, realization="fir_direct", architecture="parallel")
    assert design_plot(sosmith.design(spec).core.quantized, "svg").startswith(b"<?xml")
