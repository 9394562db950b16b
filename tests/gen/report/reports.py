"""Reports to compare."""

from __future__ import annotations

from typing import Any


def report(**changes: Any) -> dict[str, Any]:
    """Report with the keys a comparison needs; an entry of `changes` with a dot goes one level down."""
    made: dict[str, Any] = {
        "name": "flange_wear",
        "scenario": "wear_ramp",
        "realization": "df1_ef2",
        "architecture": "parallel",
        "simulator": "verilator",
        "passed": True,
        "bit_exact": True,
        "samples": 20000,
        "cycles_per_sample": 3.0,
        "error": {"unit": "mm", "max_abs": 0.00012, "max_lsb": 0.5, "rms": 0.00007, "bound": 0.0002},
        "sqnr_db": 99.0,
        "accuracy_percent": {"unfiltered": 95.0, "golden": 98.0, "hardware": 98.0},
        "latency_cycles": 10,
        "tools": {"cocotb": "2.1.0"},
        "provenance": {
            "specification": {"name": "flange_wear", "filter": {"order": 7, "cutoff": [0.25]}},
            "specification_sha256": "0" * 64,
            "reference_sha256": "1" * 64,
            "trace_sha256": "2" * 64,
            "datapath_sha256": "3" * 64,
            "cycles_per_sample": 3,
            "cost": {
                "source": "estimate",
                "board": None,
                "luts": 1000,
                "multiplier_blocks": 2,
                "register_bits": 300,
                "instructions": None,
                "memory_words": None,
                "accumulator_bits": None,
            },
        },
        "curves": {
            "error": {"time": [0.0, 1.0], "low": [-0.0001, 0.0], "high": [0.0, 0.00012]},
            "spectrum": {"frequency": [1.0, 10.0, 50.0], "density": [1e-6, 2e-6, 1e-6]},
            "filter": {
                "sample_rate": 100.0,
                "kind": "lowpass",
                "ideal_sos": [[0.25, 0.5, 0.25, 1.0, -0.5, 0.25]],
                "quantized_sos": [[0.25, 0.5, 0.25, 1.0, -0.5, 0.2501]],
            },
        },
    }
    for key, value in changes.items():
        *path, last = key.split(".")
        place = made
        for part in path:
            place = place[part]
        place[last] = value
    return made


WORSE = {"error.max_abs": 0.00013, "error.rms": 0.00008, "provenance.cost.luts": 1100, "latency_cycles": 12}
