"""Curves of one trial as a small chart in plane coordinates: pure geometry, drawn by no one here.

A viewer's own plots share one time axis over the whole run; a chart of a single trial has its own
clock, so its lines, grid and labels are laid out here in a plane of fixed size, ``x`` to the
right, ``y`` down, and shown for the trial under the cursor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: Size of the plotting area in plane units; wide, as clocks are.
WIDTH = 240.0
HEIGHT = 100.0
GRID_LINES = 4
FRACTIONS = tuple(i / GRID_LINES for i in range(GRID_LINES + 1))
#: Below this, values are nothing to anyone, and powers of ten lose their digits.
TINY = 1e-300
#: More points than pixels in a row of any screen show nothing more.
POINTS_MAX = 400


@dataclass(frozen=True, slots=True)
class Chart:
    """What differs from trial to trial.

    Attributes:
        lines: One polyline per series ``(series, points, 2)``.
        events: One upright line per event ``(events, 2, 2)``.
        labels: Texts of the marks.
    """

    lines: Array
    events: Array
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
    lines = np.empty((len(series), len(kept), 2))
    lines[..., 0] = clock[kept] * (WIDTH / end_s)
    for line, curve in zip(lines, series, strict=True):
        line[:, 1] = curve[kept]
    lines[..., 1] = _down(lines[..., 1], low, high)
    uprights = np.zeros((len(events), 2, 2))
    uprights[:, :, 0] = np.array([[at_s] for at_s, _ in events]).reshape(-1, 1) * (WIDTH / end_s)
    uprights[:, 1, 1] = HEIGHT
    labels = [_text(low + f * (high - low)) for f in FRACTIONS]
    labels += [f"{_text(f * end_s)} s" for f in FRACTIONS[1:]]
    return Chart(lines, uprights, labels)


def grid() -> list[Array]:
    """Return the polylines of the frame and the grid, the same for every chart."""
    frame = np.array([[0.0, 0.0], [0.0, HEIGHT], [WIDTH, HEIGHT]])
    rows = [np.array([[0.0, HEIGHT * f], [WIDTH, HEIGHT * f]]) for f in FRACTIONS[:-1]]
    columns = [np.array([[WIDTH * f, 0.0], [WIDTH * f, HEIGHT]]) for f in FRACTIONS[1:]]
    return [frame, *rows, *columns]


def marks() -> Array:
    """Return where the labels stand ``(labels, 2)``, the same for every chart."""
    up = [[-9.0, HEIGHT * (1.0 - f) - 4.0] for f in FRACTIONS]
    along = [[WIDTH * f, HEIGHT + 3.0] for f in FRACTIONS[1:]]
    return np.array(up + along)


def telling(series: Sequence[npt.NDArray[np.float32]], n: int) -> npt.NDArray[np.intp]:
    """Return at most ``n`` indices that keep what curves are looked at for: peaks, and the end.

    The samples are cut into equal bins; of each the one stays that is furthest from the bin's
    mean, measured by each curve's own range.

    Args:
        series: Curves ``(samples,)`` that are thinned together.
        n: At least 2.
    """
    samples = len(series[0])
    if samples <= n:
        return np.arange(samples)
    values = np.stack(series)
    np.nan_to_num(values, copy=False)
    spread = np.ptp(values, axis=1, keepdims=True)
    scaled = values / np.where(spread > 0.0, spread, np.float32(1.0))
    width = -(-(samples - 1) // (n - 1))
    n_whole = (samples - 1) // width
    whole = scaled[:, : n_whole * width].reshape(len(values), n_whole, width)
    kept = [np.arange(n_whole) * width + _furthest(whole)]
    rest = scaled[:, None, n_whole * width : -1]
    if rest.size:
        kept.append(n_whole * width + _furthest(rest))
    return np.append(np.concatenate(kept), samples - 1)


def _furthest(bins: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
    """Return for bins ``(curves, bins, width)`` which sample is furthest from the mean."""
    away = np.abs(bins - bins.mean(axis=2, keepdims=True)).max(axis=0)
    found: npt.NDArray[np.intp] = away.argmax(axis=1)
    return found


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
    share = np.clip((values - low) / (high - low), -0.02, 1.02)
    flipped: Array = HEIGHT * (1.0 - np.where(np.isnan(share), 0.0, share))
    return flipped


def _text(value: float) -> str:
    return f"{value:.4g}"
