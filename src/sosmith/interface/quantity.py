"""A number with its unit."""

from __future__ import annotations


class Quantity(float):
    """A float with a unit; arithmetic on it gives plain floats.

    Attributes
    ----------
    unit : str
        Unit such as "mm", or "" for a plain number.

    Examples
    --------
    >>> import sosmith
    >>> bound = sosmith.Quantity(0.00029, "mm")
    >>> print(bound)
    0.00029 mm
    >>> bound < 0.0003, 1000 * bound
    (True, 0.29)
    """

    unit: str

    def __new__(cls, value: float, unit: str = "") -> Quantity:
        """Make the quantity `value` in `unit`."""
        instance = super().__new__(cls, value)
        instance.unit = unit
        return instance

    def __reduce__(self) -> tuple[type[Quantity], tuple[float, str]]:
        """Keep the unit in copies and pickles."""
        return type(self), (float(self), self.unit)

    def __repr__(self) -> str:
        return f"Quantity({float(self)!r}, {self.unit!r})"

    def __str__(self) -> str:
        """Return the number with four significant digits, and the unit."""
        return f"{float(self):.4g} {self.unit}".rstrip()
