"""The 23 parameters of the insertion skill, with names, units and bounds.

The paper says that there are 23 and names a few (insertion angle, frequency of wiggling,
feed-forward force); these follow the public insertion skill of MIOS. Imports nothing heavy: the
learner's host needs the space and never an engine.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shearline.protocol.space import Space

_TURN = 2.0 * math.pi

#: Name to ``(unit, low, high)``, in the order of the tuple.
BOUNDS: dict[str, tuple[str, float, float]] = {
    # manipulation: where and how the key comes to the lock
    "app_off_x": ("m", -2e-3, 2e-3),
    "app_off_y": ("m", -2e-3, 2e-3),
    "app_tilt_x": ("rad", -math.radians(8.0), math.radians(8.0)),
    "app_tilt_y": ("rad", -math.radians(8.0), math.radians(8.0)),
    "con_speed": ("m/s", 0.005, 0.1),
    # manipulation: the insertion itself
    "ins_push": ("N", 0.0, 20.0),
    "ins_speed": ("m/s", 0.002, 0.1),
    "ins_rotspeed": ("rad/s", 0.02, 0.5),
    "wig_a_x": ("N", 0.0, 10.0),
    "wig_a_y": ("N", 0.0, 10.0),
    "wig_a_rx": ("N m", 0.0, 2.0),
    "wig_a_ry": ("N m", 0.0, 2.0),
    "wig_f_x": ("Hz", 0.0, 3.0),
    "wig_f_y": ("Hz", 0.0, 3.0),
    "wig_f_rx": ("Hz", 0.0, 3.0),
    "wig_f_ry": ("Hz", 0.0, 3.0),
    "wig_phi_y": ("rad", 0.0, _TURN),
    "wig_phi_ry": ("rad", 0.0, _TURN),
    # semantic: what counts as contact
    "con_force": ("N", 1.0, 12.0),
    # control
    "con_k_xy": ("N/m", 100.0, 2000.0),
    "ins_k_xy": ("N/m", 50.0, 2000.0),
    "ins_k_rot": ("N m/rad", 5.0, 200.0),
    "xi": ("", 0.3, 1.2),
}


class Parameters(NamedTuple):
    """One tuple by name; units and bounds as in :data:`BOUNDS`."""

    app_off_x: float
    app_off_y: float
    app_tilt_x: float
    app_tilt_y: float
    con_speed: float
    ins_push: float
    ins_speed: float
    ins_rotspeed: float
    wig_a_x: float
    wig_a_y: float
    wig_a_rx: float
    wig_a_ry: float
    wig_f_x: float
    wig_f_y: float
    wig_f_rx: float
    wig_f_ry: float
    wig_phi_y: float
    wig_phi_ry: float
    con_force: float
    con_k_xy: float
    ins_k_xy: float
    ins_k_rot: float
    xi: float


def space() -> Space:
    """Return the parameter space of the skill."""
    return Space(BOUNDS)


def parameters(theta: npt.ArrayLike) -> Parameters:
    """Name the components of a tuple ``(23,)`` in task units."""
    values = np.asarray(theta, dtype=np.float64)
    if values.shape != (len(BOUNDS),):
        raise ValueError(f"expected a tuple of {len(BOUNDS)} numbers, got shape {values.shape}")
    return Parameters(*(float(value) for value in values))
