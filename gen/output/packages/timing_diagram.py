"""The timing diagram of a core: WaveDrom source, and the same drawn as SVG."""

from __future__ import annotations

from typing import Any

import wavedrom

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.text_files import to_json


def timing_files(facts: PackageFacts) -> dict[str, str]:
    """Return source and picture by their paths in the package: two samples in, two results out, one of them stalled."""
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


def _diagram(facts: PackageFacts) -> dict[str, Any]:
    latency, spacing = facts.interface.latency_cycles, facts.core.cycles_per_sample
    signals = []
    for name, wave in (_PIPELINED if spacing == 1 else _SHARED).items():
        labels = {"s_axis_tdata": ("sample 0", "sample 1"), "m_axis_tdata": ("result 0", "result 1")}.get(name)
        signals.append({"name": name, "wave": wave} | ({} if labels is None else {"data": list(labels)}))
    rate = "every clock" if spacing == 1 else f"every {spacing} clocks"
    return {
        "signal": signals,
        "head": {"text": f"{facts.name}: a result {latency} clocks after its sample, a sample {rate}"},
        "config": {"hscale": 2},
    }
