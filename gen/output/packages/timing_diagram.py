"""The timing diagram of a core: WaveDrom source, and the same drawn as SVG."""

from __future__ import annotations

from typing import Any

import wavedrom

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.text_files import to_json


def timing_files(facts: PackageFacts) -> dict[str, str]:
    """Return source and picture by their paths in the package: two samples, or beats of them, and their results."""
    source = to_json(_diagram(facts))
    return {
        f"doc/{facts.name}_timing.json": source,
        f"doc/{facts.name}_timing.svg": wavedrom.render(source).tostring() + "\n",
    }


# One letter for each clock; `|` leaves some out. The pipeline takes samples without a pause, and its second result
# waits; a shared multiplier takes the next sample when the result before it has left.
_PIPELINED = {
    "aclk": "p...|.....",
    "s_axis_tvalid": "01.0|.....",
    "s_axis_tready": "1...|.....",
    "s_axis_tdata": "x34x|.....",
    "m_axis_tvalid": "0...|1..0.",
    "m_axis_tready": "1...|.01..",
    "m_axis_tdata": "x...|34.x.",
}
_SHARED = {
    "aclk": "p..|...|..",
    "s_axis_tvalid": "01.|.10|..",
    "s_axis_tready": "1.0|.10|..",
    "s_axis_tdata": "x34|..x|..",
    "m_axis_tvalid": "0..|10.|10",
    "m_axis_tready": "1..|...|..",
    "m_axis_tdata": "x..|3x.|4x",
}
# Behind a decimator, with a source that waits for each result; the samples between bring none.
_DECIMATED = {
    "aclk": "p..|..|..|...",
    "s_axis_tvalid": "010|..|10|...",
    "s_axis_tready": "1..|..|..|...",
    "s_axis_tdata": "x3x|..|4x|...",
    "m_axis_tvalid": "0..|10|..|.10",
    "m_axis_tready": "1..|..|..|...",
    "m_axis_tdata": "x..|3x|..|.4x",
}
_HELD = {
    "aclk": "p..|..|..|..|.",
    "s_axis_tvalid": "010|..|10|..|.",
    "s_axis_tready": "1..|..|..|..|.",
    "s_axis_tdata": "x3x|..|4x|..|.",
    "m_axis_tvalid": "0..|.1|0.|.1|0",
    "m_axis_tready": "1..|..|..|..|.",
    "m_axis_tdata": "x..|.3|x.|.4|x",
}


def _diagram(facts: PackageFacts) -> dict[str, Any]:
    latency, spacing, lanes = facts.interface.latency_cycles, facts.core.cycles_per_sample, facts.interface.inputs.lanes
    rate = "every clock" if spacing == 1 else f"every {spacing} clocks"
    waves = _PIPELINED if spacing == 1 else _SHARED
    inputs, outputs = ["sample 0", "sample 1"], ["result 0", "result 1"]
    text = f"a result {latency} clocks after its sample, a sample {rate}"
    if lanes > 1:
        ends = [f"{lane} to {lane + lanes - 1}" for lane in (0, lanes)]
        inputs, outputs = ([f"{what} {numbers}" for numbers in ends] for what in ("samples", "results"))
        text = f"{lanes} results {latency} clocks after their samples, a beat of {lanes} samples {rate}"
    decimation = facts.core.lower_rate
    if decimation is not None:
        waves, inputs = _HELD if decimation.held else _DECIMATED, ["sample 0", f"sample {decimation.factor}"]
        text = f"a result at most {latency} clocks after its sample, which is one of {decimation.factor}"
        text += f"; each result leaves {decimation.factor} times" * decimation.held
        outputs = [f"{result}, {decimation.factor} times" for result in outputs] if decimation.held else outputs
    labels = {"s_axis_tdata": inputs, "m_axis_tdata": outputs}
    return {
        "signal": [
            {"name": name, "wave": wave} | ({"data": labels[name]} if name in labels else {})
            for name, wave in waves.items()
        ],
        "head": {"text": f"{facts.name}: {text}"},
        "config": {"hscale": 2},
    }
