"""Curves of one trial as a small chart in plane coordinates: pure geometry, drawn by no one here.

A viewer's own plots share one time axis over the whole run; a chart of a single trial has its own
clock, so its lines, grid and labels are laid out here in a plane of fixed size, ``x`` to the
right, ``y`` down, and shown for the trial under the cursor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Size of the plotting area in plane units; wide, as clocks are.
WIDTH = 240.0
HEIGHT = 100.0
GRID_LINES = 4
#: Below this, values are nothing to anyone, and powers of ten lose their digits.
TINY = 1e-300
#: More points than pixels in a row of any screen show nothing more.
POINTS_MAX = 400


@dataclass(frozen=True, slots=True)
class Chart:
    """What to draw.

    Attributes:
        lines: One polyline ``(points, 2)`` per series.
        grid: Polylines of the frame and the grid.
        events: One upright line per event.
        marks: Where labels stand ``(labels, 2)``.
        labels: Their texts.
    """

    lines: list[Array]
    grid: list[Array]
    events: list[Array]
    marks: Array
    labels: list[str]


def chart(
    t_s: npt.ArrayLike,
    series: list[npt.NDArray[np.float32]],
    low: float,
    high: float,
    *,
    events: Sequence[tuple[float, str]] = (),
) -> Chart:
    """Lay out curves over a trial's clock.

    Args:
        t_s: Clock ``(samples,)`` [s], from 0.
        series: One ``(samples,)`` per curve, in one unit.
        low: Value at the bottom.
        high: Value at the top; must exceed ``low``.
        events: ``(t_s, name)``.

    Returns:
        The chart, its lines thinned to what a screen can show, peaks kept.
    """
    clock = np.asarray(t_s, dtype=np.float64)
    end_s = nice_above(float(clock[-1])) if clock.size and clock[-1] > 0 else 1.0
    kept = telling(series, POINTS_MAX)
    x = clock[kept] / end_s * WIDTH
    lines = [
        np.stack([x, _down(values[kept].astype(np.float64), low, high)], axis=1)
        for values in series
    ]
    fractions = np.linspace(0.0, 1.0, GRID_LINES + 1)
    marks_y = np.stack([np.full_like(fractions, -9.0), HEIGHT * (1.0 - fractions) - 4.0], axis=1)
    marks_x = np.stack([WIDTH * fractions[1:], np.full(GRID_LINES, HEIGHT + 3.0)], axis=1)
    labels_y = [_text(low + f * (high - low)) for f in fractions]
    labels_x = [f"{_text(f * end_s)} s" for f in fractions[1:]]
    return Chart(
        lines=lines,
        grid=_grid(fractions),
        events=[_upright(at_s / end_s * WIDTH) for at_s, _ in events],
        marks=np.concatenate([marks_y, marks_x]),
        labels=labels_y + labels_x,
    )


def telling(series: Sequence[npt.NDArray[np.float32]], n: int) -> npt.NDArray[np.intp]:
    """Return at most ``n`` indices that keep what curves are looked at for: peaks, and the end.

    The samples are cut into equal bins; of each the one stays that is furthest from the bin's
    mean, measured by each curve's own range.

    Args:
        series: Curves ``(samples,)`` that are thinned together.
        n: At least 2.
    """
    values = np.nan_to_num(np.stack(series)).astype(np.float64)
    samples = values.shape[1]
    if samples <= n:
        return np.arange(samples)
    spread = np.ptp(values, axis=1, keepdims=True)
    values /= np.where(spread > 0.0, spread, 1.0)
    width = -(-(samples - 1) // (n - 1))
    n_bins = -(-(samples - 1) // width)
    padding = n_bins * width - (samples - 1)
    padded = np.pad(values[:, :-1], ((0, 0), (0, padding)), constant_values=np.nan)
    bins = padded.reshape(len(values), n_bins, width)
    away = np.abs(bins - np.nanmean(bins, axis=2, keepdims=True))
    far = np.nan_to_num(away, nan=-1.0).max(axis=0).argmax(axis=1)
    return np.append(np.arange(n_bins) * width + far, samples - 1)


def nice_above(value: float) -> float:
    """Return the smallest of 1, 2, 2.5, 5 times a power of ten that is at least ``value`` > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    for step in (1.0, 2.0, 2.5, 5.0, 10.0):
        if step * power >= value * (1.0 - 1e-9):
            return step * power
    return 10.0 * power


def bounds(low: float, high: float) -> tuple[float, float]:
    """Return round bounds that hold ``low``, ``high`` and zero.

    One-sided values get one-sided bounds, others are centred on zero.
    """
    low, high = min(low, 0.0), max(high, 0.0)
    reach = nice_above(max(high, -low)) if max(high, -low) > TINY else 1.0
    # a little noise on the other side does not make a series two-sided
    if low > -0.05 * high:
        return 0.0, reach
    return (-reach, 0.0) if high < -0.05 * low else (-reach, reach)


def _down(values: Array, low: float, high: float) -> Array:
    share = (np.nan_to_num(values, nan=low) - low) / (high - low)
    flipped: Array = HEIGHT * (1.0 - np.clip(share, -0.02, 1.02))
    return flipped


def _grid(fractions: Array) -> list[Array]:
    frame = np.array([[0.0, 0.0], [0.0, HEIGHT], [WIDTH, HEIGHT]])
    rows = [np.array([[0.0, HEIGHT * f], [WIDTH, HEIGHT * f]]) for f in fractions[:-1]]
    columns = [np.array([[WIDTH * f, 0.0], [WIDTH * f, HEIGHT]]) for f in fractions[1:]]
    return [frame, *rows, *columns]


def _upright(x: float) -> Array:
    return np.array([[x, 0.0], [x, HEIGHT]])


def _text(value: float) -> str:
    return f"{value:.4g}"
