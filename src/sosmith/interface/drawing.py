"""A picture that a notebook shows where a cell ends with it."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Drawing:
    """A picture as SVG.

    Attributes
    ----------
    svg : str
        Text of its SVG file.
    """

    svg: str = field(repr=False)

    def _repr_svg_(self) -> str:
        return self.svg
