"""What is written on a film: a caption above, and a strip with time, depth and force below.

Curves are drawn once, at twice the size and made smaller, so that they are smooth; on each picture
only the line that says *now* and the numbers are new. Blue and orange are told apart by everyone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from shearline.evaluator.base import Trace
from shearline.evaluator.replay.again import Replayed
from shearline.evaluator.replay.video import Image
from shearline.protocol.messages import JUDGED

#: Of the strip below and of the caption above [pixels].
HEIGHT = 160
CAPTION_HEIGHT = 56

PAPER = (244, 246, 250)
INK = (28, 34, 44)
GREY = (120, 128, 140)
BLUE = (0, 90, 181)
ORANGE = (201, 90, 0)

#: Where the numbers stand, and the charts beside them [pixels].
_MARGIN, _CLOCK_WIDTH, _LABEL_WIDTH = 28, 200, 120
_TOP, _BOTTOM = 18, 142
#: More changes than this do not fit into the caption.
_CHANGES_MAX = 2
#: Curves are drawn this much larger and then made smaller.
_FINE = 2

Point = tuple[float, float]


def caption(replayed: Replayed, speed: float, width: int) -> Image:
    """Return what stands above the pictures ``(56, width, 3)``: what is shown, what was changed."""
    head, rest = said(replayed, speed)
    picture = Pillow.new("RGB", (width, CAPTION_HEIGHT), PAPER)
    draw = ImageDraw.Draw(picture)
    large, small = ImageFont.load_default(24), ImageFont.load_default(17)
    draw.text((_MARGIN, CAPTION_HEIGHT / 2), head, INK, large, anchor="lm")
    draw.text((width - _MARGIN, CAPTION_HEIGHT / 2), rest, GREY, small, anchor="rm")
    return np.asarray(picture)


def said(replayed: Replayed, speed: float) -> tuple[str, str]:
    """Return the caption in words: the trial and how it ended, and what to know about it."""
    verdict, space = replayed.verdict, replayed.case.task.space
    judged = verdict.kind in JUDGED
    cost = f", cost {verdict.cost:.3g}" if judged else ""
    why = f" ({verdict.why})" if verdict.why else ""
    triples = zip(space.items(), replayed.theta, replayed.case.theta, strict=True)
    changes = [
        f"{name} {f'{value:.4g} {unit}'.rstrip()} instead of {recorded:.4g}"
        for (name, (unit, _, _)), value, recorded in triples
        if value != recorded
    ]
    if replayed.seed != replayed.case.seed:
        changes.append(f"seed {replayed.seed}")
    if len(changes) > _CHANGES_MAX:
        changes[_CHANGES_MAX:] = [f"{len(changes) - _CHANGES_MAX} more changes"]
    pace = "in real time" if speed == 1.0 else f"at {speed:g} of real time"
    head = f"trial {replayed.case.trial}: {verdict.kind.value}{why}{cost}"
    return head, ", ".join([replayed.case.task.name, pace, *changes])


@dataclass(frozen=True, slots=True)
class _Curve:
    """One chart: its numbers, how they are called, and where it stands [pixels]."""

    name: str
    unit: str
    values: npt.NDArray[np.float64]
    colour: tuple[int, int, int]
    left: int
    right: int

    def points(self, t_s: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
        """Return where its samples lie ``(samples, 2)`` [pixels]."""
        low, high = min(0.0, float(self.values.min())), max(float(self.values.max()), 1e-9)
        x = self.left + (self.right - self.left) * t_s / max(float(t_s[-1]), 1e-9)
        y = _BOTTOM - (_BOTTOM - _TOP) * (self.values - low) / (high - low)
        return np.stack([x, y], axis=1).astype(np.float64)

    def zero_y(self) -> float:
        """Return where zero lies [pixels]."""
        low, high = min(0.0, float(self.values.min())), max(float(self.values.max()), 1e-9)
        return _BOTTOM + (_BOTTOM - _TOP) * low / (high - low)


class Strip:
    """Time, phase, depth and force of one trial.

    Args:
        trace: A key-in-lock trial's.
        width: Of the strip [pixels].
    """

    def __init__(self, trace: Trace, width: int) -> None:
        self._trace = trace
        self._curves = _curves(trace, width)
        self._points = [curve.points(trace.t_s) for curve in self._curves]
        self._ground = _ground(self._curves, self._points, width)

    def at(self, sample: int) -> Image:
        """Return the strip ``(160, width, 3)`` at one sample of the trace."""
        picture = self._ground.copy()
        draw = ImageDraw.Draw(picture)
        t_s = float(self._trace.t_s[sample])
        draw.text((_MARGIN, 30), f"{t_s:.3f} s", INK, ImageFont.load_default(38))
        draw.text((_MARGIN, 88), self._phase(t_s), GREY, ImageFont.load_default(22))
        for curve, points in zip(self._curves, self._points, strict=True):
            x, y = points[sample]
            draw.line([(x, _TOP - 6), (x, _BOTTOM + 6)], GREY, 1)
            draw.ellipse([x - 5, y - 5, x + 5, y + 5], curve.colour)
            at = curve.left - _LABEL_WIDTH
            draw.text((at, 24), curve.name, GREY, ImageFont.load_default(18))
            now = f"{curve.values[sample]:.1f}"
            draw.text((at, 50), now, curve.colour, ImageFont.load_default(38))
            draw.text((at, 100), curve.unit, GREY, ImageFont.load_default(18))
        return np.asarray(picture)

    def _phase(self, t_s: float) -> str:
        """Return the latest event, by name."""
        return [name for at_s, name in self._trace.events if at_s <= t_s + 1e-6][-1]


def _curves(trace: Trace, width: int) -> list[_Curve]:
    columns = {name: values.astype(np.float64) for name, (_, values) in trace.columns.items()}
    force = np.sqrt(sum(columns[f"wrench.{axis}"] ** 2 for axis in ("fx", "fy", "fz")))
    first = _MARGIN + _CLOCK_WIDTH + _LABEL_WIDTH
    chart = (width - first - _LABEL_WIDTH - 3 * _MARGIN) // 2
    second = first + chart + 2 * _MARGIN + _LABEL_WIDTH
    return [
        _Curve("depth", "mm", 1e3 * columns["depth"], BLUE, first, first + chart),
        _Curve("force", "N", force, ORANGE, second, second + chart),
    ]


def _ground(
    curves: list[_Curve], points: list[npt.NDArray[np.float64]], width: int
) -> Pillow.Image:
    """Draw what stays the same: paper, the line of zero, the curves."""
    large = Pillow.new("RGB", (width * _FINE, HEIGHT * _FINE), PAPER)
    draw = ImageDraw.Draw(large)
    for curve, path in zip(curves, points, strict=True):
        zero = curve.zero_y() * _FINE
        draw.line([(curve.left * _FINE, zero), (curve.right * _FINE, zero)], (205, 210, 218), _FINE)
        draw.line([(x * _FINE, y * _FINE) for x, y in path.tolist()], curve.colour, 2 * _FINE)
    return large.resize((width, HEIGHT), Pillow.Resampling.LANCZOS)
