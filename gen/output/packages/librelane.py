"""Files for LibreLane, which makes layouts with open tools: its configuration, and the constraints of the clock.

Its variables are those of LibreLane 3.0.17, flow Classic. The process is left open: `--pdk` says it.
"""

from __future__ import annotations

from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.model.templates import render
from sosmith.model.text_files import to_json

IO_SHARE = 0.2
"""Part of a period that is outside the core, before an input and behind an output: an assumption."""


def librelane_files(facts: PackageFacts) -> dict[str, str]:
    """Return configuration and constraints by their paths in the package."""
    name = facts.name
    constraints = f"{name}.sdc"
    configuration = {
        "meta": {"version": 2, "flow": "Classic"},
        "DESIGN_NAME": name,
        "VERILOG_FILES": [f"dir::../core/{name}.sv"],
        "CLOCK_PORT": "aclk",
        "CLOCK_PERIOD": facts.period,
        "PNR_SDC_FILE": f"dir::{constraints}",
        "SIGNOFF_SDC_FILE": f"dir::{constraints}",
    }
    ports = {
        output: [f"{pin.name}{'*' * (pin.width > 1)}" for pin in facts.pins if pin.output is output]
        for output in (False, True)
    }
    values = {
        "name": name,
        "period": f"{facts.period:.3f}",
        "delay": f"{IO_SHARE * facts.period:.3f}",
        "inputs": [port for port in ports[False] if port != "aclk"],
        "outputs": ports[True],
    }
    return {
        "librelane/config.json": to_json(configuration),
        f"librelane/{constraints}": render(__package__, "librelane.sdc.jinja", **values),
    }
