"""Parameters of locomotive, track and irregularities, from a TOML file with unit and source of every number."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

from sosmith.model.errors import SpecificationError
from sosmith.model.suggestion import did_you_mean
from sosmith.model.tables.toml_file import parse_toml, read_toml

_WHAT = "the file of parameters"

MAX_BYTES = 1 << 16
"""Largest file size in bytes; the built-in file has about ten thousand."""

LABELS = ("[published]", "[paper]", "[from memory]", "[derived]", "[assumed]")
"""Labels that a source may begin with."""

_LARGEST = 1e12
"""Upper limit of every quantity in its SI unit, to catch mistyped values."""


def _quantity(unit: str, text: str, *, zero: bool = False, below: float = _LARGEST) -> Any:
    """Return a field for a quantity in `unit`: positive, or 0 if `zero`, and less than `below`."""
    return field(metadata={"unit": unit, "text": text, "zero": zero, "below": below})


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Positions of axles and bogies along the vehicle; the bogies are mirror images."""

    bogie_distance: float = _quantity("m", "between the bogies' centres")
    outer_axle_spacing: float = _quantity("m", "outer to middle axle of a bogie")
    inner_axle_spacing: float = _quantity("m", "middle to inner axle of a bogie")


@dataclass(frozen=True, kw_only=True)
class Wheelset:
    """One wheelset, with its share of the motor's mass."""

    mass: float = _quantity("kg", "mass")
    yaw_inertia: float = _quantity("kg m^2", "moment of inertia about the vertical")
    rolling_radius: float = _quantity("m", "radius of the wheels")
    conicity: float = _quantity("1", "equivalent conicity", below=1.0)
    contact_half_spacing: float = _quantity("m", "half the distance of the contacts")


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contact ellipse at a reference load, and its Kalker coefficients."""

    reference_load: float = _quantity("N", "load of a wheel")
    longitudinal_semi_axis: float = _quantity("m", "semi-axis along the rail")
    lateral_semi_axis: float = _quantity("m", "semi-axis across the rail")
    shear_modulus: float = _quantity("Pa", "modulus of wheel and rail")
    c11: float = _quantity("1", "longitudinal coefficient")
    c22: float = _quantity("1", "lateral coefficient")
    c23: float = _quantity("1", "coefficient of lateral force and spin", zero=True)
    c33: float = _quantity("1", "coefficient of spin moment", zero=True)
    friction: float = _quantity("1", "coefficient of friction")
    flange_stiffness: float = _quantity("N/m", "of the rail against the flange, across the track")
    flange_transition: float = _quantity("m", "way from first flange contact to its full stiffness")


@dataclass(frozen=True, kw_only=True)
class Mass:
    """A bogie frame or the body."""

    mass: float = _quantity("kg", "mass")
    yaw_inertia: float = _quantity("kg m^2", "moment of inertia about the vertical")
    roll_inertia: float = _quantity("kg m^2", "moment of inertia about the direction of travel")
    pitch_inertia: float = _quantity("kg m^2", "moment of inertia about the axles' direction")
    centre_height: float = _quantity("m", "height of the centre of gravity above the rails")


@dataclass(frozen=True, kw_only=True)
class Primary:
    """Suspension of one axle box; each wheelset has two."""

    longitudinal_stiffness: float = _quantity("N/m", "stiffness", zero=True)
    lateral_stiffness: float = _quantity("N/m", "stiffness at the outer and inner wheelset", zero=True)
    middle_lateral_stiffness: float = _quantity("N/m", "stiffness at the middle wheelset", zero=True)
    vertical_stiffness: float = _quantity("N/m", "stiffness")
    longitudinal_damping: float = _quantity("N s/m", "damping", zero=True)
    lateral_damping: float = _quantity("N s/m", "damping", zero=True)
    vertical_damping: float = _quantity("N s/m", "damping", zero=True)
    half_spacing: float = _quantity("m", "half the distance of the axle boxes")


@dataclass(frozen=True, kw_only=True)
class Secondary:
    """Suspension between a bogie frame and the body, on one side; each bogie has two."""

    longitudinal_stiffness: float = _quantity("N/m", "stiffness", zero=True)
    lateral_stiffness: float = _quantity("N/m", "stiffness", zero=True)
    vertical_stiffness: float = _quantity("N/m", "stiffness")
    longitudinal_damping: float = _quantity("N s/m", "damping", zero=True)
    lateral_damping: float = _quantity("N s/m", "damping", zero=True)
    vertical_damping: float = _quantity("N s/m", "damping", zero=True)
    half_spacing: float = _quantity("m", "half the distance of the springs")
    height: float = _quantity("m", "height of the springs above the rails")
    yaw_damping: float = _quantity("N s/m", "damping of a yaw damper", zero=True)
    yaw_damper_half_spacing: float = _quantity("m", "half the distance of the yaw dampers")


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Position of the sensor on the bogie frame relative to the flange."""

    arm: float = _quantity("m", "distance ahead of the axle")
    flank_slope: float = _quantity("1", "lateral over radial direction of the flange's flank", zero=True)
    flange_clearance: float = _quantity("m", "lateral way of the wheelset from the centre to the flange")


@dataclass(frozen=True, kw_only=True)
class TrackTable:
    """Tangent, spiral, curve to the left, spiral, tangent, with a single lateral irregularity at the beginning."""

    tangent: float = _quantity("m", "length before the curve", zero=True, below=1e5)
    spiral: float = _quantity("m", "length of either transition", below=1e5)
    curve: float = _quantity("m", "length of constant radius", zero=True, below=1e5)
    radius: float = _quantity("m", "radius of the curve")
    cant: float = _quantity("m", "superelevation of the outer rail", zero=True, below=0.3)
    gauge_widening: float = _quantity("m", "widening in the curve", zero=True, below=0.1)
    run_out: float = _quantity("m", "length behind the curve", zero=True, below=1e5)
    irregularity: float = _quantity("m", "amplitude", zero=True, below=1.0)
    irregularity_length: float = _quantity("m", "length")


@dataclass(frozen=True, kw_only=True)
class IrregularityTable:
    """Power spectral density of alignment and level, S = A Oc^2 / ((O^2 + Or^2)(O^2 + Oc^2)), one-sided."""

    alignment_low: float = _quantity("rad m", "A of the alignment, good track")
    alignment_high: float = _quantity("rad m", "A of the alignment, bad track")
    level_low: float = _quantity("rad m", "A of the level, good track")
    level_high: float = _quantity("rad m", "A of the level, bad track")
    upper_wavenumber: float = _quantity("rad/m", "Oc")
    lower_wavenumber: float = _quantity("rad/m", "Or")
    shortest_wavelength: float = _quantity("m", "end of the band")
    longest_wavelength: float = _quantity("m", "beginning of the band")


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """All parameters of the vehicle's motion, in SI units.

    Attributes
    ----------
    layout, wheelset, contact, frame, body, primary, secondary, sensor, track, irregularities
        The tables of the file.
    sources : dict of str
        Source of each number by its path, such as ``wheelset.mass``; each begins with one of `LABELS`.
    """

    layout: Layout
    wheelset: Wheelset
    contact: Contact
    frame: Mass
    body: Mass
    primary: Primary
    secondary: Secondary
    sensor: Sensor
    track: TrackTable
    irregularities: IrregularityTable
    sources: dict[str, str]

    @property
    def total_mass(self) -> float:
        """Mass of the locomotive in kg."""
        return 6 * self.wheelset.mass + 2 * self.frame.mass + self.body.mass


_TABLES: dict[str, type[Any]] = {
    "layout": Layout,
    "wheelset": Wheelset,
    "contact": Contact,
    "frame": Mass,
    "body": Mass,
    "primary": Primary,
    "secondary": Secondary,
    "sensor": Sensor,
    "track": TrackTable,
    "irregularities": IrregularityTable,
}

T = TypeVar("T")


def built_in_text() -> str:
    """Return the text of the built-in file: a locomotive of class HXD1C, as far as its parameters are known."""
    return (resources.files("sosmith.instrument.vehicle") / "locomotive.toml").read_text(encoding="utf-8")


def built_in() -> Parameters:
    """Return the built-in parameters."""
    return parse(built_in_text(), "locomotive.toml")


def load(path: Path) -> Parameters:
    """Read a parameter file; it must contain every parameter.

    Raises
    ------
    SpecificationError
        If the file cannot be read or is not TOML; if a table or key is unknown or missing; if an entry is not a value
        with unit and source, its unit is wrong, its value is not a number in range, or its source has no label; if
        two values contradict each other. The message is one sentence: file, key, what was expected, what was found.
    """
    tree = read_toml(path, what=_WHAT, max_bytes=MAX_BYTES)
    return _parameters(tree, str(path))


def parse(text: str, name: str) -> Parameters:
    """Read parameters from the text of a file called `name`; raises as `load` does."""
    return _parameters(parse_toml(text, name, what=_WHAT), name)


def _parameters(tree: dict[str, Any], name: str) -> Parameters:
    _check_keys(name, "", tree, list(_TABLES))
    sources: dict[str, str] = {}
    tables = {key: _table(name, key, tree[key], kind, sources) for key, kind in _TABLES.items()}
    parameters = Parameters(**tables, sources=sources)
    _check_together(name, parameters)
    return parameters


def _table(name: str, path: str, tree: Any, kind: type[T], sources: dict[str, str]) -> T:
    if not isinstance(tree, dict):
        raise SpecificationError(f"{name}: {path} must be a table, not {tree!r}")
    known = {one.name: one for one in fields(kind)}  # type: ignore[arg-type]
    _check_keys(name, path, tree, list(known))
    values = {}
    for key, one in known.items():
        where = f"{path}.{key}"
        values[key] = _value(f"{name}: {where}", tree[key], one.metadata)
        sources[where] = tree[key]["source"]
    return kind(**values)


def _check_keys(name: str, path: str, tree: dict[str, Any], known: list[str]) -> None:
    where = f"{name}: {path}" if path else name
    for key in tree:
        if key not in known:
            hint = did_you_mean(key, known)
            raise SpecificationError(f"{where} must only have the keys {', '.join(known)}, not {key!r}{hint}")
    for key in known:
        if key not in tree:
            raise SpecificationError(f"{where} must have the key {key}, not leave it out")


def _value(where: str, entry: Any, rule: Any) -> float:
    unit = rule["unit"]
    form = f'{{ value = ..., unit = "{unit}", source = "..." }}'
    if not isinstance(entry, dict) or set(entry) != {"value", "unit", "source"}:
        raise SpecificationError(f"{where} must be {form}, not {entry!r}")
    value, source = entry["value"], entry["source"]
    if entry["unit"] != unit:
        raise SpecificationError(f"{where} must be in the unit {unit!r}, not {entry['unit']!r}")
    if not isinstance(source, str) or not source.startswith(LABELS):
        raise SpecificationError(f"{where} must have a source that begins with {' or '.join(LABELS)}, not {source!r}")
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not 0 <= value < rule["below"] or not (value or rule["zero"]):
        least = "0 or more" if rule["zero"] else "more than 0"
        raise SpecificationError(f"{where} must be a number of {least} and less than {rule['below']:g}, not {value!r}")
    return float(value)


def _check_together(name: str, parameters: Parameters) -> None:
    """Reject values that contradict each other."""
    layout, track, waves = parameters.layout, parameters.track, parameters.irregularities
    wheelbase = layout.outer_axle_spacing + layout.inner_axle_spacing
    if layout.bogie_distance <= wheelbase:
        raise SpecificationError(
            f"{name}: layout.bogie_distance must be more than the wheelbase of a bogie, {wheelbase:g} m, "
            f"not {layout.bogie_distance:g}"
        )
    if track.radius < 10 * layout.bogie_distance:
        raise SpecificationError(
            f"{name}: track.radius must be at least ten times layout.bogie_distance for small angles, "
            f"not {track.radius:g}"
        )
    if waves.shortest_wavelength >= waves.longest_wavelength:
        raise SpecificationError(
            f"{name}: irregularities.shortest_wavelength must be less than longest_wavelength, "
            f"not {waves.shortest_wavelength:g}"
        )
