"""A hinge with spring and damper, for an engine that moves by semi-implicit Euler.

Such an engine takes the torque of the state before each step. A key of 5e-6 kg m^2 between pads
of 5 N m/rad swings with 160 Hz: at steps of .5 ms it would swing 6 % too fast and die away 9 %
too soon. Shorter steps cost as much again; a softer spring would bend too far under a load that
stays. Some more inertia and another damping do neither (:func:`stepped`). Nothing here knows an
engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Hinge:
    """What an engine is to be given so that it moves as a hinge does.

    Attributes:
        stiffness: Torque over angle [N m/rad].
        damping: Torque over the speed before the step [N m s/rad].
        added: Inertia about the axis beyond that of the body which turns [kg m^2].
    """

    stiffness: float
    damping: float
    added: float

    def torque(self, angle: float, speed: float) -> float:
        """Return the torque for the next step [N m], from angle [rad] and speed [rad/s]."""
        return -self.stiffness * angle - self.damping * speed


def stepped(stiffness: float, damping: float, inertia: float, step_s: float) -> Hinge:
    """Return the hinge whose steps are samples of the damped swing itself.

    With ``E = exp(-damping step / 2 inertia)`` and the phase p that goes by in a step, samples of
    a free swing follow ``next = 2 E cos(p) now - E^2 before``, and semi-implicit Euler with
    inertia M and damping c ``next = (2 - (k step^2 + c step) / M) now - (1 - c step / M) before``:
    equal for one M and one c, with the stiffness k, and so the rest under load, left as it is.
    What turns faster than half a swing in a step is given just that: it dies away all the same.

    Args:
        stiffness: Of the spring [N m/rad].
        damping: [N m s/rad].
        inertia: Of the body about the axis [kg m^2].
        step_s: Length of the engine's steps [s].
    """
    rate, square = damping / (2.0 * inertia), stiffness / inertia
    shrink = math.exp(-rate * step_s)
    if square > rate**2:
        cosine = math.cos(min(step_s * math.sqrt(square - rate**2), math.pi))
    else:
        cosine = math.cosh(step_s * math.sqrt(rate**2 - square))
    whole = stiffness * step_s**2 / (1.0 - 2.0 * shrink * cosine + shrink**2)
    return Hinge(stiffness, whole * (1.0 - shrink**2) / step_s, whole - inertia)
