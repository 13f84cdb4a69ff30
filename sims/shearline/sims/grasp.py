"""How the fingers hold the key: rubber pads that give, and a key that never sits quite the same.

The nominal grasp is rigid and exact. A lab's is neither: the key is picked up a little off, and
turns between the pads when it is loaded. The arm's controller knows of neither: it goes by where
the tip would be in the nominal grasp. Nothing here knows an engine.
"""

from __future__ import annotations

from dataclasses import dataclass

#: From the tip back to the middle of the grip along the key [m]: 26 mm of blade, half the bow.
GRIP_M = 32e-3

#: Where a pad touches the bow: along the key's height, along its length, and how thick it is [m].
PAD_HIGH_M = 18e-3
PAD_LONG_M = 12e-3
PAD_THICK_M = 2e-3
#: Young's modulus of a rubber of 40 Shore A (Gent 1958) [Pa]; hardly compressible, so that the
#: shear modulus is a third of it.
PAD_YOUNG_PA = 1.7e6


@dataclass(frozen=True, slots=True)
class Grasp:
    """What is between hand and key; in itself a rigid grasp, in which the key may sit off.

    A key between two pads twists about the line from finger to finger (x of the key) and bends
    about its own height (y). What gives along the axes is left out: two pads resist with 120 N/mm.

    Attributes:
        stiffness: About x and y [N m/rad]; nothing gives if empty.
        damping: The same [N m s/rad].
    """

    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()


def rubber() -> Grasp:
    """Return a grasp between two pads, 4.8 and 4.4 N m/rad.

    Shear of a layer that is twisted, ``2 G J / t``, and compression of one that is bent,
    ``2 E I / t``, with ``J = h l (h^2 + l^2) / 12``, ``I = h l^3 / 12``; that a thin layer
    bonded to its finger is stiffer against bending is left out. Damping is a loss factor of .2 at
    the key's own frequency of 100 Hz (an assumption, high for rubber).
    """
    high, long, thick = PAD_HIGH_M, PAD_LONG_M, PAD_THICK_M
    polar, across = high * long * (high**2 + long**2) / 12.0, high * long**3 / 12.0
    twist, bend = 2.0 * PAD_YOUNG_PA / 3.0 * polar / thick, 2.0 * PAD_YOUNG_PA * across / thick
    return Grasp(stiffness=(twist, bend), damping=(1.5e-3, 1.4e-3))
