"""The success rate of each episode, with its interval."""

from __future__ import annotations

import numpy as np

from shearline.record.report import marks
from shearline.record.report.chance import wilson
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup
from shearline.record.report.plot import Axis, card, path, plot
from shearline.record.report.scale import Scale
from shearline.record.report.words import between, share

#: A rate's axis.
RATE = Axis(
    Scale(0.0, 1.0),
    "success rate",
    [(rate, share(rate)) for rate in (0.0, 0.25, 0.5, 0.75, 1.0)],
)
#: Of more episodes only the band is drawn.
WHISKERS_MAX = 40


def picture(facts: Facts) -> Markup:
    """Return success over episodes."""
    episodes = facts.episodes
    title = "Success in each episode"
    if not len(episodes.number):
        return card(title, note="No trial has reached success or failure yet.")
    rate = episodes.successes / episodes.trials
    low, high = wilson(episodes.successes, episodes.trials)
    axis = episode_axis(int(episodes.number[-1]) + 1)
    x = axis.scale.place(episodes.number + 1.0)
    layers = [
        path("band", marks.band(x, low, high)),
        path("whisker", marks.uprights(x, low, high)) if len(x) <= WHISKERS_MAX else None,
        path("line", marks.line(x, rate)),
        *(
            path(
                "dot ok" if len(x) > WHISKERS_MAX else "dot ok big",
                marks.dots(x[i], rate[i]),
                _title(facts, i, low[i], high[i]),
            )
            for i in range(len(x))
        ),
    ]
    about = f"{title}: {share(float(rate[0]))} at first, {share(float(rate[-1]))} in the end"
    note = "With its 95 % interval (Wilson)."
    return card(title, plot(layers, axis, RATE, about), note=note)


def episode_axis(count: int) -> Axis:
    """Return an axis of so many episodes, counted from 1."""
    scale = Scale(0.5, count + 0.5)
    step = max(1, -(-count // 8))
    step = next(s for s in (1, 2, 5, 10, 20, 50, 100, 200, 500, 10**6) if s >= step)
    numbers = [n for n in range(1, count + 1) if n == 1 or n % step == 0]
    if step > 1 and len(numbers) > 1 and numbers[1] - 1 < step / 2:
        numbers = numbers[1:]
    return Axis(scale, "episode", [(n, str(n)) for n in numbers])


def _title(facts: Facts, i: int, low: np.float64, high: np.float64) -> str:
    episodes = facts.episodes
    won, trials = int(episodes.successes[i]), int(episodes.trials[i])
    return (
        f"episode {episodes.number[i] + 1}: {won} of {trials} succeeded"
        f" (95 % interval {between(float(low), float(high))})"
    )
