"""Packs a chain: its files, a bench that needs nothing else of sosmith, and scripts of other tools."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from sosmith.gen.chain.design import ChainDesign
from sosmith.gen.chain.generate import chain_texts
from sosmith.gen.chain.rates import samples_of
from sosmith.gen.chain.top import chain_interface, top_ports
from sosmith.gen.output.packages.bench import SPARE, bench_texts
from sosmith.gen.output.packages.fusesoc import core_file
from sosmith.gen.output.packages.vendor_tools import scripts
from sosmith.gen.output.packages.vlnv import Vlnv
from sosmith.gen.output.vectors import Vectors, hex_words
from sosmith.gen.version import __version__
from sosmith.model.arrays import Codes
from sosmith.model.templates import render
from sosmith.model.text_files import write_files

_MOST = 8192
"""Most transfers of a part of the stimuli: an event-driven simulator takes them in seconds."""
_HELD = 64
"""Results for which a corner of the inputs is held, at most."""
_SEED = 1


def package_chain(
    design: ChainDesign,
    directory: Path,
    progress: Callable[[str], None] = lambda step: None,
    *,
    vlnv: Vlnv | None = None,
) -> list[Path]:
    """Write the package of a chain into `directory`; return the paths of the files. Two runs write the same bytes.

    Raises
    ------
    SpecificationError
        If the folder cannot be written.
    ToolError
        If Yosys fails, or the disk is full.
    """
    folders: dict[Path, dict[str, str]] = {}
    for path, text in packed_chain(design, progress, vlnv=vlnv).items():
        place = directory / path
        folders.setdefault(place.parent, {})[place.name] = text
    return [path for folder, texts in folders.items() for path in write_files(folder, texts)]


def packed_chain(
    design: ChainDesign, progress: Callable[[str], None] = lambda step: None, *, vlnv: Vlnv | None = None
) -> dict[str, str]:
    """Return the texts that `package_chain` writes, by their paths in the package."""
    named = vlnv or Vlnv.default(design.name)
    texts = chain_texts(design, progress)
    progress("bench")
    modules = [*(module for stage in design.stages for module in stage.modules), design.name]
    period, pins = round(float(10**9 / design.spec.base.hardware.clock), 3), top_ports(design)
    unit = design.spec.base.output.unit
    description = (
        f"chain of {', '.join(stage.spec.kind for stage in design.stages)}"
        + (f", interpolated by {design.rise}" if design.rise > 1 else "")
        + (f", decimated by {design.factor}" if design.factor > 1 else "")
        + f", error at most {float(design.bound):.6g} {unit}".rstrip()
    )
    readme = render(
        "sosmith.gen.chain",
        "package.md.jinja",
        name=design.name,
        description=description,
        version=__version__,
        vlnv=named,
        stages=[(stage.spec.name, stage.modules, stage.spec.kind) for stage in design.stages],
        pins=pins,
        factor=design.factor,
        rise=design.rise,
        period=period,
        modules=modules,
    )
    return {
        "README.md": readme,
        f"{design.name}.core": core_file(modules, named, description),
        **{f"core/{name}": text for name, text in texts.items()},
        **_bench(design, modules),
        **scripts(modules, period, [pin for _, pin, _ in pins]),
    }


def _bench(design: ChainDesign, modules: list[str]) -> dict[str, str]:
    interface, (codes, parts) = chain_interface(design), _stimuli(design)
    responses, status = design.compute_with_status(codes)
    vectors, came = Vectors(stimuli=codes, responses=responses, status=status), samples_of(design.rates, len(status))
    hex_in, hex_out = hex_words(vectors, interface, came)
    into, out = interface.inputs, interface.outputs
    clocks = sum(max(2, *(core.architecture.cycles_per_sample for core in stage.cores)) for stage in design.stages)
    values: dict[str, Any] = {
        "state": f"{design.name}_state",
        "pushes": True,
        "parts": parts,
        "transfers": hex_in.count("\n"),
        "results": hex_out.count("\n"),
        "counted": "results",
        "lanes": 1,
        "line": 80,
        "factor": design.factor,
        "rise": design.rise,
        "copies": 1,
        "dest": into.dest_width,
        "data_in": into.width,
        "data_out": out.width,
        "stimulus": into.dest_width + into.width,
        "data_user": out.width + out.user_width,
        "response": out.dest_width + out.user_width + out.width,
        "registers": [(pin, width, way == "output") for way, pin, width in top_ports(design) if "axil" in pin],
        "patience": interface.reset_cycles
        + interface.latency_cycles
        + clocks * design.factor * design.rise * design.spec.base.channels
        + SPARE,
        "channels": design.spec.base.channels,
        "takes_channel": False,
        "inputs": into.fields,
        "output": design.spec.base.output,
    }
    models = [*(core.datapath.name for stage in design.stages for core in stage.cores), design.name]
    return bench_texts(modules, hex_in, hex_out, values, models=models)


def _stimuli(design: ChainDesign) -> tuple[Codes, tuple[str, ...]]:
    """Return codes, shape (samples, channels, inputs), and what they are: corners of the inputs, and noise.

    Channel k lags channel 0 by k samples.
    """
    base = design.spec.base
    most = max(_MOST // (base.channels * max(design.rise // design.factor, 1)), 8)
    corners = list(product(*((port.lowest, port.highest) for port in base.inputs)))
    held = min(_HELD * design.factor, -(-most // (2 * len(corners))))
    ends = np.repeat(np.array(corners, dtype=np.int64), held, axis=0)
    rng = np.random.default_rng(_SEED)
    noise = np.stack([rng.integers(p.lowest, p.highest, most // 2, endpoint=True) for p in base.inputs], axis=1)
    first = np.concatenate([ends, noise])
    lagging = np.maximum(np.arange(len(first))[:, np.newaxis] - np.arange(base.channels), 0)
    parts = (f"{len(ends)} samples: corners of the inputs", f"{len(noise)} samples: noise, uniform over all codes")
    return first[lagging], parts
