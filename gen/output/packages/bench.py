"""The bench of a package: checks hardware and C model with vectors in files, and needs nothing else of sosmith."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sosmith.gen.core import CoreDesign
from sosmith.gen.output.packages.facts import PackageFacts
from sosmith.gen.output.packages.lint_waivers import verilator_waivers
from sosmith.gen.output.packages.stimuli import bench_stimuli
from sosmith.gen.output.vectors import hex_words
from sosmith.model.templates import render

SPARE = 64
"""Clocks beyond a core's longest pause, in which the bench stalls its output or has no sample ready."""


def bench_files(design: CoreDesign, facts: PackageFacts) -> dict[str, str]:
    """Return the texts of the bench by their paths in the package.

    Parameters
    ----------
    design : CoreDesign
        The core.
    facts : PackageFacts
        What its package says about it.
    """
    interface, datapath = facts.interface, design.datapath
    stimuli = bench_stimuli(design, interface)
    hex_in, hex_out = hex_words(stimuli.vectors, interface)
    into, out, lanes = interface.inputs, interface.outputs, interface.inputs.lanes
    sent, results = hex_in.count("\n"), hex_out.count("\n")
    # The samples of a result, each with a pause of the source.
    each = max(2, facts.core.cycles_per_sample)
    gathered = each * interface.samples_per_result if facts.core.lower_rate is not None else 0
    lower_rate = facts.core.lower_rate
    values = {
        "state": f"{facts.name}_{'state' if lower_rate is None else 'decimator'}",
        "pushes": lower_rate is not None,
        "parts": stimuli.parts,
        "transfers": sent,
        "results": results,
        "counted": "beats" if lanes > 1 else "results" if lower_rate is not None else "samples",
        "lanes": lanes,
        "line": max(into.width, out.width + out.user_width) // 4 + 8,
        "factor": None if lower_rate is None else lower_rate.factor,
        "rise": 1,
        "copies": interface.copies_per_result,
        "width_in": into.sample_width,
        "width_out": out.sample_width,
        "dest": into.dest_width,
        "data_in": into.width,
        "data_out": out.width,
        "stimulus": into.dest_width + into.width,
        "data_user": out.width + out.user_width,
        "response": out.dest_width + out.user_width + out.width,
        "registers": [(pin.name, pin.width, pin.output) for pin in facts.pins if pin.bus == "s_axil"],
        "patience": interface.reset_cycles + interface.latency_cycles + each + gathered + SPARE,
        "channels": facts.core.channels,
        "takes_channel": len(datapath.wear) > 1,
        "inputs": into.fields,
        "output": datapath.output,
    }
    return bench_texts([facts.name], hex_in, hex_out, values, joins=datapath.decimator is not None)


def bench_texts(
    modules: Sequence[str],
    hex_in: str,
    hex_out: str,
    values: Mapping[str, Any],
    *,
    models: Sequence[str] = (),
    joins: bool = False,
) -> dict[str, str]:
    """Return the texts of a bench for modules of a file each, the last of which is the top.

    Parameters
    ----------
    modules : sequence of str
    hex_in, hex_out : str
        The vectors.
    values : mapping of str
        Of the other placeholders of the templates.
    models : sequence of str
        Names of the C models, if they are not those of the modules.
    joins : bool
        Whether a single module joins a decimator and a core.
    """
    name = modules[-1]
    values = {"name": name, "modules": modules, "models": models or modules, **values}
    return {
        f"bench/{name}_bench.sv": render(__package__, "bench.sv.jinja", **values),
        f"bench/{name}_bench.c": render(__package__, "bench.c.jinja", **values),
        f"bench/{name}_stimuli.hex": hex_in,
        f"bench/{name}_responses.hex": hex_out,
        "bench/Makefile": render(__package__, "Makefile.jinja", **values),
        f"verilator/{name}.vlt": verilator_waivers(modules, joins=len(modules) > 1 or joins),
    }
