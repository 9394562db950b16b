"""What a page tells of the behaviour."""

from __future__ import annotations

from sosmith.gen.report.provenance import Provenance


def told() -> Provenance:
    names = ("specification", "reference", "trace", "datapath")
    return Provenance(
        specification={}, cycles_per_sample=1, cost={}, **{f"{name}_sha256": name[0] * 64 for name in names}
    )
