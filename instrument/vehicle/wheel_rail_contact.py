"""Linear forces between wheelset and rails: Kalker's creep forces, conicity, gravitational stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sosmith.instrument.vehicle.linear_motion import Array
from sosmith.instrument.vehicle.parameters import Contact

GRAVITY = 9.81
"""Gravitational acceleration in m/s^2."""


@dataclass(frozen=True, kw_only=True)
class Creep:
    """Kalker's linear creep coefficients of one wheel.

    The longitudinal force is -f11 * longitudinal creepage, the lateral force -f22 * lateral creepage - f23 * spin, the
    moment about the normal f23 * lateral creepage - f33 * spin.

    Attributes
    ----------
    f11, f22 : float
        In N.
    f23 : float
        In N m.
    f33 : float
        In N m^2.
    """

    f11: float
    f22: float
    f23: float = 0.0
    f33: float = 0.0


def creep_coefficients(contact: Contact, load: float) -> Creep:
    """Return Kalker's coefficients for a wheel that carries `load` N.

    f11 = G a b C11, f22 = G a b C22, f23 = G (a b)^(3/2) C23, f33 = G (a b)^2 C33 (Kalker 1967), with semi-axes a, b
    proportional to the cube root of the load (Hertz).
    """
    scale = (load / contact.reference_load) ** (1 / 3)
    area = contact.longitudinal_semi_axis * contact.lateral_semi_axis * scale**2
    modulus = contact.shear_modulus
    return Creep(
        f11=modulus * area * contact.c11,
        f22=modulus * area * contact.c22,
        f23=modulus * area**1.5 * contact.c23,
        f33=modulus * area**2 * contact.c33,
    )


def contact_matrices(
    creep: Creep, *, speed: float, conicity: float, rolling_radius: float, half_spacing: float, load: float
) -> tuple[Array, Array]:
    """Return damping and stiffness from both contacts for a wheelset's (lateral, yaw) relative to the track.

    Lateral and yaw are positive to the left. With V the speed, l the half spacing, r the rolling radius,
    c the conicity and W the load of the wheelset (Garg and Dukkipati 1984, Wickens 2003, both from memory; the
    gravitational terms follow from the roll c y / l of a coned wheelset):

        lateral:  2 f22 (y'/V - psi) + 2 f23 psi'/V + W c / l y
        yaw:      2 f11 (l^2 psi'/V + l c y / r) - 2 f23 (y'/V - psi) + 2 f33 psi'/V - W c l psi

    Returns
    -------
    damping, stiffness : ndarray, shape (2, 2)
    """
    f11, f22, f23, f33 = creep.f11, creep.f22, creep.f23, creep.f33
    damping = 2 / speed * np.array([[f22, f23], [-f23, f11 * half_spacing**2 + f33]])
    stiffness = np.array(
        [
            [load * conicity / half_spacing, -2 * f22],
            [2 * f11 * half_spacing * conicity / rolling_radius, 2 * f23 - load * conicity * half_spacing],
        ]
    )
    return damping, stiffness


def klingel_frequency(speed: float, conicity: float, rolling_radius: float, half_spacing: float) -> float:
    """Return the frequency in Hz of a free wheelset rolling without creep (Klingel 1883): V/(2 pi) sqrt(c / (r l))."""
    return float(speed / (2 * np.pi) * np.sqrt(conicity / (rolling_radius * half_spacing)))
