"""Who was busy when: one lane for each evaluator over the run's own time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shearline.protocol.messages import EvaluatorState
from shearline.record.report import marks
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, tag
from shearline.record.report.plot import Axis, card, legend, path, surface
from shearline.record.report.scale import Scale
from shearline.record.report.words import count, share

#: Lanes of one page; the most hard-working are shown.
LANES_MAX = 40
#: How states are grouped for the eye.
LOOKS = {
    "busy": "busy",
    "idle": "idle",
    "held": "resting",
    "resting": "resting",
    "silent": "missing",
    "lost": "missing",
    "gone": "missing",
}
#: In the order of the legend.
WORDS = {"busy": "busy", "idle": "idle", "resting": "resting", "missing": "silent or gone"}


@dataclass(frozen=True, slots=True)
class Stretch:
    """A time in one state.

    Attributes:
        look: A value of :data:`LOOKS`.
        start_s: Since the run began [s].
        end_s: Likewise [s].
    """

    look: str
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Lane:
    """One evaluator.

    Attributes:
        name: Its name.
        done: Results it delivered.
        lost: Attempts it lost.
        stretches: Its states in order of time; nothing while it was away on purpose.
    """

    name: str
    done: int
    lost: int
    stretches: tuple[Stretch, ...]

    def busy_s(self) -> float:
        """Return how long it held trials [s]."""
        return sum(s.end_s - s.start_s for s in self.stretches if s.look == "busy")


def lanes(states: Sequence[EvaluatorState], begin_s: float, end_s: float) -> list[Lane]:
    """Return one lane for each evaluator, in order of name.

    Args:
        states: Every change, in order of time.
        begin_s: Of the run [s since the epoch].
        end_s: Likewise.
    """
    by_name: dict[str, list[EvaluatorState]] = {}
    for state in states:
        by_name.setdefault(state.evaluator, []).append(state)
    return [_lane(name, by_name[name], begin_s, end_s) for name in sorted(by_name)]


def picture(facts: Facts) -> Markup:
    """Return the lanes of a run."""
    title = "Evaluators over time"
    length_s = facts.end_s - facts.begin_s
    found = lanes(facts.run.evaluators, facts.begin_s, facts.end_s)
    if not found or length_s <= 0.0:
        return card(title, note="The record says nothing about evaluators.")
    shown = found
    if len(found) > LANES_MAX:
        most = sorted(found, key=lambda lane: -lane.busy_s())[:LANES_MAX]
        shown = sorted(most, key=lambda lane: lane.name)
    axis = Axis(Scale(0.0, length_s), "time of the run [s]")
    rows = [_row(lane, axis, length_s) for lane in shown]
    present = {s.look for lane in shown for s in lane.stretches}
    keys = legend(*((look, words) for look, words in WORDS.items() if look in present))
    note = (
        f"{count(len(found), 'evaluator')}; the share of time that each held trials, at the right."
    )
    if len(shown) < len(found):
        note += f" The {len(shown)} busiest are shown."
    ticks = tag("div", *(_tick(at, text) for at, text in axis.marks(6)), class_="x")
    below = tag("div", ticks, tag("div", axis.label, class_="x-name"), class_="lane-axis")
    return card(title, tag("div", *rows, below, class_="rows lanes"), keys, note=note)


def _row(lane: Lane, axis: Axis, length_s: float) -> Markup:
    layers = [_stretches(lane, axis, look) for look in WORDS]
    busy = lane.busy_s() / length_s
    said = f"{lane.name}: busy {share(busy)}, {count(lane.done, 'result')}, {lane.lost} lost"
    return tag(
        "div",
        tag("span", lane.name, class_="name"),
        surface(layers, said, class_="lane"),
        tag("span", share(busy), class_="value"),
        class_="row",
        title=said,
    )


def _stretches(lane: Lane, axis: Axis, look: str) -> Markup | None:
    found = [(s.start_s, s.end_s) for s in lane.stretches if s.look == look]
    if not found:
        return None
    start, end = (axis.scale.place(column) for column in zip(*_merged(found, axis), strict=True))
    low, high = (0.08, 0.92) if look == "busy" else (0.38, 0.62)
    return path(f"bar {look}", marks.bars(start, end, low, high))


def _merged(spans: list[tuple[float, float]], axis: Axis) -> list[tuple[float, float]]:
    """Join stretches whose gap no screen could show."""
    least_s = (axis.scale.high - axis.scale.low) / (2 * marks.SIDE)
    joined = [spans[0]]
    for start_s, end_s in spans[1:]:
        if start_s - joined[-1][1] < least_s:
            joined[-1] = (joined[-1][0], end_s)
        else:
            joined.append((start_s, end_s))
    return joined


def _lane(name: str, states: list[EvaluatorState], begin_s: float, end_s: float) -> Lane:
    ends = [state.at_s for state in states[1:]] + [max(end_s, states[-1].at_s)]
    stretches = tuple(
        Stretch(LOOKS[state.state], state.at_s - begin_s, until_s - begin_s)
        for state, until_s in zip(states, ends, strict=True)
        if state.state in LOOKS and until_s > state.at_s
    )
    done = int(np.max([state.done for state in states]))
    return Lane(name, done, int(np.max([state.lost for state in states])), stretches)


def _tick(at: float, text: str) -> Markup:
    return tag("span", text, style=f"left:{100 * at:.4g}%")
