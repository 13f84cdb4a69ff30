"""Colours of the view, each named once: outcomes, curves, and what stands in the background."""

from __future__ import annotations

from typing import TypeAlias

from shearline.protocol.messages import OutcomeKind

Colour: TypeAlias = tuple[int, int, int]

GREEN: Colour = (70, 200, 120)
RED: Colour = (235, 90, 80)
GREY: Colour = (130, 130, 140)
YELLOW: Colour = (200, 170, 70)
WHITE: Colour = (235, 235, 240)
BLUE: Colour = (86, 156, 240)
ORANGE: Colour = (240, 160, 60)
COLOURS: dict[OutcomeKind | None, Colour] = {
    OutcomeKind.SUCCESS: GREEN,
    OutcomeKind.FAILURE: RED,
    None: GREY,
}
#: Distinct on dark and light ground, also without red and green side by side first.
SERIES: tuple[Colour, ...] = (
    BLUE,
    ORANGE,
    (120, 210, 190),
    (220, 120, 200),
    (200, 200, 90),
    (160, 130, 240),
    (240, 120, 100),
)


def series(n: int) -> list[Colour]:
    """Return a colour for each of ``n`` curves."""
    return [SERIES[i % len(SERIES)] for i in range(n)]


def packed(colour: Colour) -> int:
    """Return a colour as the viewer stores it: 0xRRGGBBAA."""
    red, green, blue = colour
    return (red << 24) | (green << 16) | (blue << 8) | 0xFF
