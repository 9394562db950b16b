"""Types of sensors by name, or from a TOML file."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from sosmith.instrument.calibration.sensor_type import LEAST_ORDER, MOST_ORDER, SENSOR_TYPES, SensorType
from sosmith.model.errors import SpecificationError
from sosmith.model.tables.csv_table import shortened
from sosmith.model.tables.toml_tables import Table, read_tables


class _Tolerances(Table):
    name: str = Field(min_length=1, max_length=80, description="a text of 1 to 80 characters")
    curve: list[float] = Field(
        min_length=5, max_length=5, description="a list of 5 numbers: of 1, V, T, V T and V V, in mm, V and degC"
    )
    offset: float = Field(SensorType.offset, ge=1e-6, le=1000, description="a number of V from 1e-6 to 1000")
    gain: float = Field(SensorType.gain, ge=1e-6, le=1000, description="a number from 1e-6 to 1000")
    offset_per_100_K: float = Field(  # noqa: N815 - the unit
        SensorType.offset_per_100_K, ge=1e-6, le=1000, description="a number of V from 1e-6 to 1000"
    )
    gain_per_100_K: float = Field(  # noqa: N815
        SensorType.gain_per_100_K, ge=1e-6, le=1000, description="a number from 1e-6 to 1000"
    )
    curvature: float = Field(SensorType.curvature, ge=1e-6, le=1000, description="a number from 1e-6 to 1000")
    offset_drift: float = Field(SensorType.offset_drift, ge=0, le=1000, description="a number of V from 0 to 1000")
    gain_drift: float = Field(SensorType.gain_drift, ge=0, le=1000, description="a number from 0 to 1000")
    systematic: float = Field(SensorType.systematic, ge=1e-6, le=1000, description="a number of mm from 1e-6 to 1000")
    correlation: float = Field(SensorType.correlation, ge=0.1, le=1000, description="a number of mm from 0.1 to 1000")
    order: int = Field(
        SensorType.order,
        ge=LEAST_ORDER,
        le=MOST_ORDER,
        strict=True,
        description=f"a whole number from {LEAST_ORDER} to {MOST_ORDER}",
    )


def sensor_type_named(name: str) -> SensorType:
    """Return a built-in type, or that of a TOML file whose keys are the attributes of `SensorType`.

    Raises
    ------
    SpecificationError
        If it is neither; as for `read_tables`; if the type is impossible.
    """
    if name in SENSOR_TYPES:
        return SENSOR_TYPES[name]
    path = Path(name)
    if path.suffix.lower() != ".toml":
        known = ", ".join(SENSOR_TYPES)
        raise SpecificationError(f"the type of a sensor must be one of {known}, or a TOML file, not {shortened(name)}")
    read = read_tables(path, _Tolerances)
    constant, c_v, c_t, c_vt, c_vv = read.curve
    try:
        return SensorType(**read.model_dump(exclude={"curve"}), curve=(constant, c_v, c_t, c_vt, c_vv))
    except SpecificationError as error:
        raise SpecificationError(f"{path}: {error}") from None
