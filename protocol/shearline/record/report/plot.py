"""One plot: a plane of SVG that fills its card, with axes in HTML around it.

The plane stretches, text does not: at any width, on a phone and on paper, labels keep their size
and strokes their width. What is drawn in the plane is up to the pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shearline.record.report import marks
from shearline.record.report.markup import Child, Markup, join, tag
from shearline.record.report.scale import Scale
from shearline.record.report.words import number


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis with its labels.

    Attributes:
        scale: What lies where.
        label: What it shows, with the unit.
        ticks: ``(value, text)``; ``None`` for round numbers.
    """

    scale: Scale
    label: str
    ticks: Sequence[tuple[float, str]] | None = None

    def marks(self, about: int) -> list[tuple[float, str]]:
        """Return ``(share of the axis, text)`` of each tick."""
        ticks = self.ticks
        if ticks is None:
            ticks = [(value, number(value)) for value in self.scale.ticks(about)]
        return [(float(self.scale.place(value)), text) for value, text in ticks]


def plot(layers: Sequence[Child], x: Axis, y: Axis, about: str, *, shape: str = "wide") -> Markup:
    """Return a plot.

    Args:
        layers: Elements of SVG, the lowest first.
        x: The axis below.
        y: The axis at the left, its label above.
        about: What can be seen, for those who cannot see it.
        shape: ``"wide"``, ``"low"`` or ``"square"``.
    """
    across, up = x.marks(3 if shape == "square" else 6), y.marks(4)
    lines = marks.grid((at for at, _ in across), (at for at, _ in up))
    plane = surface([path("grid", lines), *layers], about)
    return tag(
        "div",
        tag("div", y.label, class_="y-name"),
        tag("div", *(_label(text, "bottom", at) for at, text in up), class_="y"),
        plane,
        tag("div", *(_label(text, "left", at) for at, text in across), class_="x"),
        tag("div", x.label, class_="x-name"),
        class_=f"plot {shape}",
    )


def surface(layers: Sequence[Child], about: str, **attributes: str) -> Markup:
    """Return a plane that stretches to the room it is given."""
    return tag(
        "svg",
        *layers,
        viewBox=f"0 0 {marks.SIDE} {marks.SIDE}",
        preserveAspectRatio="none",
        role="img",
        aria_label=about,
        **attributes,
    )


def path(kind: str, data: str, title: str | None = None, style: str | None = None) -> Markup | None:
    """Return one path of some class, with a title that shows under a cursor; nothing if empty."""
    if not data:
        return None
    return tag("path", tag("title", title) if title else None, class_=kind, d=data, style=style)


def legend(*entries: tuple[str, str]) -> Markup:
    """Return what the marks mean, ``(class of the mark, words)`` each."""
    items = (tag("li", tag("i", class_=f"key {kind}"), words) for kind, words in entries)
    return tag("ul", *items, class_="legend")


def card(title: str, *body: Child, note: Child = None, wide: bool = False) -> Markup:
    """Return one picture with its title and how to read it."""
    kind = "card wide" if wide else "card"
    caption = tag("figcaption", note) if note else None
    return tag("figure", tag("h3", title), join(body), caption, class_=kind)


def _label(text: str, side: str, at: float) -> Markup:
    return tag("span", text, style=f"{side}:{100 * at:.4g}%")
