"""Motion of the vehicle over time, and the change of clearance at a sensor on the bogie frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from sosmith.instrument.vehicle.lateral import WHEELSETS, axle_positions, frame_of
from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.parameters import Parameters


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Motion at n times, in SI units. Lateral and yaw are positive to the left, roll with the left side up.

    Lateral, yaw and roll are relative to the designed track at each part: to its centre line, direction and cant.
    Vertical is relative to the height of the rails before the curve, so it includes the cant.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Time in s, 0 when the first wheelset is at the beginning of the track.
    distance : ndarray, shape (n,)
        Distance of the first wheelset in m.
    wheelset_lateral, wheelset_yaw, wheelset_vertical : ndarray, shape (n, 6)
        In m, rad and m.
    frame_lateral, frame_yaw, frame_roll, frame_vertical, frame_pitch : ndarray, shape (n, 2)
        In m and rad.
    body_lateral, body_yaw, body_roll, body_vertical, body_pitch : ndarray, shape (n,)
        In m and rad.
    wheelset_yaw_to_frame : ndarray, shape (n, 6)
        Yaw of the wheelsets relative to their frames in rad. In a curve this is not the difference of the two above.
    left_wheel_rise, right_wheel_rise : ndarray, shape (n, 6)
        Rise of the wheel's centre above the rails due to conicity, in m.
    clearance_mm : ndarray, shape (n, 6)
        Change of the clearance in mm at a sensor that faces the flange of the right wheel, to be added to the
        clearance at rest. At the left wheel it has the opposite sign.
    lateral_to_rails : ndarray, shape (n, 6)
        Lateral position of the wheelsets relative to the rails, including irregularities, in m.
    body_acceleration : ndarray, shape (n,)
        Lateral acceleration in m/s^2 that is felt in the body, to the left: of its motion and of gravity as it rolls.
    friction_used : ndarray, shape (n, 6)
        Resultant of longitudinal and lateral creep force over the friction limit, at the wheel where it is larger.
    flange_force : ndarray, shape (n, 6)
        Force in N of the rail against the flange that it meets.
    wheel_load : ndarray, shape (n, 6, 2)
        Vertical load in N of the left and the right wheel.
    guiding_force : ndarray, shape (n, 6, 2)
        Lateral force in N of the left and the right wheel on its rail, outward.
    """

    time: Array
    distance: Array
    wheelset_lateral: Array
    wheelset_yaw: Array
    wheelset_vertical: Array
    frame_lateral: Array
    frame_yaw: Array
    frame_roll: Array
    frame_vertical: Array
    frame_pitch: Array
    body_lateral: Array
    body_yaw: Array
    body_roll: Array
    body_vertical: Array
    body_pitch: Array
    wheelset_yaw_to_frame: Array
    left_wheel_rise: Array
    right_wheel_rise: Array
    clearance_mm: Array
    lateral_to_rails: Array
    body_acceleration: Array
    friction_used: Array
    flange_force: Array
    wheel_load: Array
    guiding_force: Array

    def __post_init__(self) -> None:
        for one in fields(self):
            getattr(self, one.name).setflags(write=False)

    @property
    def derailment_quotient(self) -> Array:
        """Guiding force over load, Y/Q, at the wheel where it is larger, shape (n, 6)."""
        return np.asarray((self.guiding_force / self.wheel_load).max(axis=2))

    def columns(self) -> Iterator[tuple[str, Array]]:
        """Yield every motion with a column name that includes the unit, such as ``wheelset1_lateral_mm``."""
        yield "time_s", self.time
        yield "distance_m", self.distance
        for part, count in (("wheelset", 6), ("frame", 2), ("body", 1)):
            for number in range(count):
                for motion in ("lateral", "vertical", "yaw", "roll", "pitch"):
                    values = getattr(self, f"{part}_{motion}", None)
                    if values is not None:
                        unit = "mm" if motion in ("lateral", "vertical") else "mrad"
                        label = f"{part}{number + 1}" if count > 1 else part
                        yield f"{label}_{motion}_{unit}", 1e3 * (values[:, number] if count > 1 else values)
        for number in range(6):
            yield f"wheelset{number + 1}_yaw_to_frame_mrad", 1e3 * self.wheelset_yaw_to_frame[:, number]
        for number in range(6):
            yield f"clearance{number + 1}_mm", self.clearance_mm[:, number]


def clearance_change(
    parameters: Parameters,
    *,
    wheelset_lateral: Array,
    wheelset_yaw: Array,
    frame_lateral: Array,
    frame_yaw: Array,
    frame_roll: Array,
) -> Array:
    """Return the change of the clearance in mm at the right wheels' sensors, shape (n, 6).

    Positions refer to a straight line, not to the curved track. The sensor is fixed to the frame. At axle height
    and `sensor.arm` ahead of the axle, it faces the flank of the flange from the field side, across the track. At the
    right wheel the clearance grows by

        y_w + arm psi_w - (y_f + (a + arm) psi_f + h roll_f) - slope l (psi_w - psi_f),

    with a the distance of the axle ahead of the frame's centre, h the height of that centre above the axle, and l half
    the distance of the wheels: yaw also moves the wheel along the track by l (psi_w - psi_f), which the slope of the
    flank turns into a lateral displacement. Relative vertical motion has no first-order effect, as the paper (5.1)
    says.

    Parameters
    ----------
    wheelset_lateral, wheelset_yaw : ndarray, shape (n, 6)
        In m and rad.
    frame_lateral, frame_yaw, frame_roll : ndarray, shape (n, 2)
        In m and rad.
    """
    sensor, half = parameters.sensor, parameters.wheelset.contact_half_spacing
    above = parameters.frame.centre_height - parameters.wheelset.rolling_radius
    axles = axle_positions(parameters.layout)
    change = np.zeros_like(wheelset_lateral)
    for k in WHEELSETS:
        f = frame_of(k)
        yaw = wheelset_yaw[:, k] - frame_yaw[:, f]
        across = wheelset_lateral[:, k] - frame_lateral[:, f] - axles[k] * frame_yaw[:, f] - above * frame_roll[:, f]
        change[:, k] = across + (sensor.arm - sensor.flank_slope * half) * yaw
    return 1e3 * change
