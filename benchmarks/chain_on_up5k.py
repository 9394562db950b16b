"""The receiver of the recipes on an iCE40 UP5K: cells and clock, as the placer reports them.

`python -m benchmarks.chain_on_up5k` prints them; it takes a minute. The top is placed by itself: its streams are at
pins, but for the flags, for which the package has too few.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import sosmith
from sosmith.gen.fpga.block_paths import with_block_paths
from sosmith.gen.fpga.tools import find_tool
from sosmith.model.errors import ToolError

SPECIFICATION = Path(__file__).parent.parent / "examples" / "recipes" / "receiver.toml"
_CELLS = ("ICESTORM_LC", "ICESTORM_RAM", "ICESTORM_DSP")
_SEED = 1


def placed(specification: Path, folder: Path) -> tuple[dict[str, tuple[int, int]], float]:
    """Return the cells of each kind, used and there, and the highest clock in MHz."""
    chain = sosmith.design_chain(specification)
    chain.generate(folder)
    name = chain.name
    files = " ".join(f"{each}.sv" for each in (*(stage.name for stage in chain.stages), name))
    streams = chain.manifest["streams"]
    (folder / "pins.sv").write_text(
        _pins(name, streams["s_axis"]["width"], streams["m_axis"]["width"]), encoding="ascii"
    )
    script = f"read_verilog -sv {files} pins.sv; synth_ice40 -dsp -top pins -json {name}_net.json"
    _run("yosys", ["-q", "-p", script], folder)
    arguments = ["--up5k", "--package", "sg48", "--seed", str(_SEED), "--freq", "24", "--json", f"{name}_net.json"]
    wishes = ["--report", "report.json", "--sdf", "delays.sdf", "--pcf-allow-unconstrained"]
    _run("nextpnr-ice40", [*arguments, *wishes], folder)
    told, delays, netlist = (
        (folder / file).read_text(encoding="utf-8") for file in ("report.json", "delays.sdf", f"{name}_net.json")
    )
    report = with_block_paths(json.loads(told), delays, json.loads(netlist))
    cells = {kind: (entry["used"], entry["available"]) for kind, entry in report["utilization"].items()}
    return {kind: cells[kind] for kind in _CELLS}, min(timing["achieved"] for timing in report["fmax"].values())


def _pins(name: str, taken: int, given: int) -> str:
    """Return a top module around a chain, without its flags."""
    ports = {
        "aclk": "input",
        "aresetn": "input",
        "s_axis_tdata": f"input [{taken - 1}:0]",
        "s_axis_tvalid": "input",
        "s_axis_tready": "output",
        "m_axis_tdata": f"output [{given - 1}:0]",
        "m_axis_tvalid": "output",
        "m_axis_tready": "input",
    }
    declared = ", ".join(f"{direction} {port}" for port, direction in ports.items())
    joined = ", ".join(f".{port}({port})" for port in ports)
    return f"module pins({declared});\n  {name} chain ({joined}, .m_axis_tuser());\nendmodule\n"


def _run(tool: str, arguments: list[str], folder: Path) -> None:
    log = folder / "placing.log"
    if find_tool(tool).run(arguments, folder, log):
        raise ToolError(f"{tool} failed: {log.read_text(encoding='utf-8')[-500:]}")


def main() -> None:
    """Print what the receiver takes."""
    with TemporaryDirectory() as folder:
        cells, clock = placed(SPECIFICATION, Path(folder))
    for kind, (used, there) in cells.items():
        print(f"{kind}: {used} of {there}")
    print(f"clock: {clock:.1f} MHz")


if __name__ == "__main__":
    main()
