"""The wear limit of the paper's section 6."""

from __future__ import annotations

from sosmith.instrument.paper.comparison import Part, compare
from sosmith.instrument.paper.figures import PaperFigures


def wear_part(figures: PaperFigures) -> Part:
    """s_w = s_r - s_i, and the largest wear."""
    thick, thin, stated, reach, first = (
        figures.number("wear", name)
        for name in ("thickest_flange", "thinnest_flange", "largest_wear", "sensor_range", "initial_clearance")
    )
    allowed = thick - thin
    return Part(
        title="Wear depth $s_w$",
        where=figures.where("wear"),
        finding=(
            f"a flange from {thick} to {thin} mm may wear by {allowed} mm, not {stated} mm, which is all that the "
            f"sensor reaches"
        ),
        before=("$$s_w = s_r - s_i$$",),
        comparisons=(
            compare(
                r"$s_{w,max}$", stated, allowed, "mm",
                note=f"{thick} mm - {thin} mm",
            ),
            compare(
                r"$s_{w,max}$ as what the sensor can measure", stated, reach - first, "mm",
                note=f"{reach} mm of range - {first} mm of initial clearance is the printed figure",
            ),
            compare(
                r"range needed, $s_{w,max} + s_i$", None, allowed + first, "mm",
                note=f"the sensor has {reach} mm and reaches its end {allowed + first - reach} mm before the limit",
            ),
        ),
    )  # fmt: skip
