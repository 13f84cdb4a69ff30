"""Which parameters matter: how much of the outcome each one explains on its own, and the picture.

Trials are ranked within their episode, from the cheapest success to the dearest failure. A
parameter's importance is the share of the ranks' variance that a parabola in it explains (the
within, or fixed effects, estimator of panel data): a learner moves all parameters and the outcome
together from episode to episode, which would make every parameter seem to matter. Episodes weigh
as much as they vary the parameters: late ones say little. What ranks shuffled within their episodes
reach by chance is said beside it. Nothing here knows what a parameter does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, tag
from shearline.record.report.plot import card
from shearline.record.report.words import share

Array = npt.NDArray[np.float64]

#: Shuffles that the level of chance rests on.
SHUFFLES = 200
#: Fewer trials say nothing about any parameter.
TRIALS_MIN = 10
#: Less is rounding.
TINY = 1e-9


@dataclass(frozen=True, slots=True)
class Importance:
    """Of each parameter.

    Attributes:
        explained: Share of the ranks' variance ``(n,)``, 0 to 1.
        chance: What 95 % of shuffles stay below ``(n,)``.
    """

    explained: Array
    chance: Array

    def order(self) -> list[int]:
        """Return the parameters' indices, the one that matters most first."""
        return [int(i) for i in np.argsort(-self.explained, kind="stable")]


def importance(u: Array, ranks: Array, episode: npt.NDArray[np.int64]) -> Importance | None:
    """Return how much of the ranks each parameter explains; ``None`` where nothing can be told.

    Args:
        u: Tuples ``(trials, n)``, 0 to 1.
        ranks: One for each trial ``(trials,)``.
        episode: Of each trial ``(trials,)``; trials are only compared within theirs.
    """
    places = _places(ranks, episode)
    weight = _weights(u, episode)
    if len(ranks) < TRIALS_MIN or float(np.abs(weight * places).max()) < TINY:
        return None
    rng = np.random.default_rng(0)
    shuffled = [_shuffled(places, episode, rng) for _ in range(SHUFFLES)]
    rows = weight * np.stack([places, *shuffled])
    shares = np.stack([_explained(rows, column, weight, episode) for column in u.T], axis=1)
    return Importance(shares[0], np.quantile(shares[1:], 0.95, axis=0))


def ranked(cost: Array, success: npt.NDArray[np.bool_]) -> Array:
    """Rank trials ``(trials,)`` from the cheapest success to the dearest failure, ties alike."""
    worth = np.stack([~success, cost])
    order = np.lexsort(worth[::-1])
    new = np.any(np.diff(worth[:, order], axis=1) != 0.0, axis=0)
    group = np.concatenate([[0], np.cumsum(new)])
    places = np.arange(len(cost), dtype=np.float64)
    mean = np.bincount(group, weights=places) / np.bincount(group)
    ranks = np.empty(len(cost))
    ranks[order] = mean[group]
    return ranks


def of_run(facts: Facts) -> Importance | None:
    """Return the importance of a run's parameters over all trials that have a cost."""
    told = facts.success | facts.failure
    if not told.any():
        return None
    ranks = ranked(facts.table["cost"][told], facts.success[told])
    return importance(facts.u[told], ranks, facts.table["episode"][told])


def picture(facts: Facts, found: Importance | None) -> Markup:
    """Return one bar for each parameter, with the level of chance."""
    title = "What matters"
    if found is None:
        return card(
            title, note="Outcomes are too few or too much alike to tell which parameters matter."
        )
    reach = max(float(found.explained.max()), float(found.chance.max()), 1e-9)
    rows = [_row(facts.names[i], found.explained[i], found.chance[i], reach) for i in found.order()]
    note = (
        "Share of the outcome (trials ranked within their episode by cost, failures last) that"
        " each parameter explains on its own; up to the line, chance alone would do. Episodes"
        " weigh as much as they vary the parameters. A parameter that the learner hardly varies"
        " cannot show what it does."
    )
    return card(title, tag("div", *rows, class_="rows bars"), note=note)


def _row(name: str, explained: float, chance: float, reach: float) -> Markup:
    weak = " weak" if explained <= chance else ""
    return tag(
        "div",
        tag("span", name, class_="name"),
        tag(
            "span",
            tag("i", class_=f"fill{weak}", style=f"width:{100 * explained / reach:.3g}%"),
            tag("i", class_="mark", style=f"left:{100 * chance / reach:.3g}%"),
            class_="track",
        ),
        tag("span", share(float(explained)), class_="value"),
        class_="row",
        title=f"{name} explains {share(float(explained))}, chance {share(float(chance))}",
    )


def _places(ranks: Array, episode: npt.NDArray[np.int64]) -> Array:
    """Return each trial's place among its episode's ``(trials,)``, -0.5 to 0.5, ties alike."""
    places = np.zeros(len(ranks))
    for number in np.unique(episode):
        members = episode == number
        own = ranks[members]
        below = (own[:, None] > own).sum(axis=1) - (own[:, None] < own).sum(axis=1)
        places[members] = below / (2.0 * len(own))
    return places


def _weights(u: Array, episode: npt.NDArray[np.int64]) -> Array:
    """Return how widely each trial's episode varies the parameters ``(trials,)``, root mean square.

    Being common to all parameters, it makes none seem to matter more than another.
    """
    squares = np.mean(_centred(u.T, episode) ** 2, axis=0)
    _, place = np.unique(episode, return_inverse=True)
    means = np.bincount(place, weights=squares) / np.bincount(place)
    weights: Array = np.sqrt(means)[place]
    return weights


def _explained(rows: Array, values: Array, weight: Array, episode: npt.NDArray[np.int64]) -> Array:
    """Return the share of variance of weighted rows ``(rows, trials)`` that a parabola explains."""
    powers = weight * _centred(np.stack([values, np.square(values - values.mean())]), episode)
    axes, sizes, _ = np.linalg.svd(powers.T, full_matrices=False)
    axes = axes[:, sizes > TINY]
    shares: Array = np.sum((rows @ axes) ** 2, axis=1) / np.sum(rows**2, axis=1)
    return shares


def _centred(rows: Array, episode: npt.NDArray[np.int64]) -> Array:
    """Return rows ``(rows, trials)`` less their mean in each episode."""
    _, place = np.unique(episode, return_inverse=True)
    member = np.equal.outer(place, np.arange(place.max(initial=-1) + 1)).astype(np.float64)
    means = rows @ member / member.sum(axis=0)
    centred: Array = rows - means[:, place]
    return centred


def _shuffled(ranks: Array, episode: npt.NDArray[np.int64], rng: np.random.Generator) -> Array:
    """Return ranks ``(trials,)`` shuffled within their episodes."""
    order = np.argsort(episode, kind="stable")
    shuffled = np.lexsort((rng.random(len(ranks)), episode))
    result = np.empty_like(ranks)
    result[order] = ranks[shuffled]
    return result
