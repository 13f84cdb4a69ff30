"""Slices of the partition, as the paper's figure 3 shows it: white is good, blue is not.

One slice for each pair of the parameters that part successes from failures most, through the
middle of what is good; samples are projected onto it, successes green, failures red. The pairs
are chosen once, so that episodes can be compared. Where the function comes from is said in
:mod:`shearline.record.partition`.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import rerun as rr

from shearline.protocol.messages import Snapshot
from shearline.record.palette import GREEN, GREY, RED, WHITE, Colour, packed
from shearline.record.panels import labels
from shearline.record.partition import (
    SIDE,
    Array,
    Samples,
    decision,
    middle,
    samples_of,
    telling,
)
from shearline.record.sheet import Sheet
from shearline.record.topics import RunConfig

#: Slices shown; the first is of the two parameters that tell most.
SLICES = 4
#: Ground of what the filter accepts and refuses, and of where there is no filter yet.
ACCEPTED = np.array([246.0, 248.0, 252.0])
REFUSED = np.array([96.0, 128.0, 186.0])
UNPARTED = np.array([205.0, 210.0, 220.0])
#: Marks along each axis.
MARKS = 3


class Slices:
    """The partition over episodes.

    Args:
        sheet: Where rows go.
        config: Names, units and bounds of the parameters.
    """

    def __init__(self, sheet: Sheet, config: RunConfig | None) -> None:
        self._sheet = sheet
        self._config = config
        self._pairs: list[tuple[int, int]] = []

    def choose(self, u: Array, success: npt.NDArray[np.bool_]) -> None:
        """Choose the pairs by tuples ``(m, n)`` in unit coordinates and their outcomes ``(m,)``."""
        self._pairs = pairs(telling(u, success))
        self._frames()

    def draw(self, snapshot: Snapshot, first_trial: int) -> None:
        """Draw one model, valid from this trial on."""
        model = json.loads(snapshot.model) if snapshot.model else {}
        samples = samples_of(model) if isinstance(model, Mapping) else None
        if samples is None or self._config is None:
            return
        if samples.u.shape[1] != len(self._config.names):
            return
        if not self._pairs:
            self.choose(samples.u, samples.good)
        at = middle(model, samples)
        for slot, (x, y) in enumerate(self._pairs):
            self._slice(f"partition/{slot}", (x, y), ground(model, at, x, y), samples, first_trial)

    def _slice(
        self,
        path: str,
        pair: tuple[int, int],
        image: npt.NDArray[np.uint8],
        samples: Samples,
        first_trial: int,
    ) -> None:
        stream = self._sheet.stream
        stream.reset_time()
        stream.set_time("trial", sequence=first_trial)
        stream.log(f"{path}/ground", rr.Image(image, draw_order=-10.0))
        x, y = pair
        spots = SIDE * np.stack([samples.u[:, x], 1.0 - samples.u[:, y]], axis=1)
        colours = np.where(samples.good, packed(GREEN), packed(RED)).astype(np.uint32)
        stream.log(f"{path}/samples", rr.Points2D(spots, colors=colours))
        stream.reset_time()

    def _frames(self) -> None:
        """Draw once the names and bounds of each slice's parameters."""
        assert self._config is not None
        for slot, (x, y) in enumerate(self._pairs):
            path = f"partition/{slot}"
            style = rr.Points2D.from_fields(radii=[rr.Radius.ui_points(2.6)], draw_order=10.0)
            self._sheet.static(f"{path}/samples", style)
            marks, texts, colours = _axes(self._config, x, y)
            self._sheet.static(f"{path}/axes", labels(marks, texts, colours))


def pairs(order: list[int]) -> list[tuple[int, int]]:
    """Return the pairs to show, of parameters in order of how much they tell."""
    found = list(itertools.combinations(order[:4], 2))
    return sorted(found, key=lambda pair: order.index(pair[0]) + order.index(pair[1]))[:SLICES]


def ground(model: Mapping[str, Any], at: Array, x: int, y: int) -> npt.NDArray[np.uint8]:
    """Return the ground of one slice ``(SIDE, SIDE, 3)``."""
    values = decision(model, at, x, y)
    if values is None:
        return np.tile(UNPARTED, (SIDE, SIDE, 1)).astype(np.uint8)
    # accepted is white; refused is bluer the farther away
    reach = max(float(-values.min()), 1e-12)
    depth = 0.25 + 0.75 * np.clip(-values / reach, 0.0, 1.0)[..., None]
    refused = REFUSED * depth + UNPARTED * (1.0 - depth)
    return np.where(values[..., None] >= 0.0, ACCEPTED, refused).astype(np.uint8)


def _axes(
    config: RunConfig, x: int, y: int
) -> tuple[npt.NDArray[np.float64], list[str], list[Colour]]:
    shares = np.linspace(0.0, 1.0, MARKS)
    along_x = [(SIDE * share, SIDE + 3.0) for share in shares]
    along_y = [(-5.0, SIDE * (1.0 - share)) for share in shares]
    texts = [_value(config, x, share) for share in shares]
    texts += [_value(config, y, share) for share in shares]
    marks = [*along_x, *along_y, (SIDE / 2, SIDE + 8.0), (SIDE * 0.12, -4.0)]
    texts += [_name(config, x), _name(config, y)]
    return np.array(marks), texts, [*[GREY] * (2 * MARKS), WHITE, WHITE]


def _value(config: RunConfig, parameter: int, share: float) -> str:
    low, high = config.low[parameter], config.high[parameter]
    return f"{low + share * (high - low):.3g}"


def _name(config: RunConfig, parameter: int) -> str:
    unit = config.units[parameter]
    return f"{config.names[parameter]} [{unit}]" if unit else config.names[parameter]
