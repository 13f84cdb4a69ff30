"""The learner's partition in two parameters at a time, with the samples: the paper's figure 3.

A slice goes through the recommended tuple: all other parameters are as recommended. Where the
learner published no partition, the samples stand with what the next trials were drawn from.
"""

from __future__ import annotations

from itertools import combinations, islice
from typing import Any

import numpy as np

from shearline.record.report import marks
from shearline.record.report.contour import positive, zero
from shearline.record.report.decision import Decision, decision_of
from shearline.record.report.facts import Facts
from shearline.record.report.importance import Importance
from shearline.record.report.markup import Markup, tag
from shearline.record.report.plot import Axis, card, legend, path, plot
from shearline.record.report.proposal import ellipses
from shearline.record.report.scale import Array, Scale

#: Parameters that are cut in pairs, those that matter most.
PARAMETERS_MAX = 4
#: Models that are looked at, back from the last.
MODELS_MAX = 50
#: Points along each side of a slice.
GRID = 49


def picture(facts: Facts, found: Importance | None) -> Markup | None:
    """Return slices of the partition; ``None`` where there are no two parameters or no trials."""
    told = facts.success | facts.failure
    if len(facts.names) < 2 or not told.any():
        return None
    order = found.order() if found else list(range(len(facts.names)))
    pairs = list(combinations(sorted(order[:PARAMETERS_MAX]), 2))
    cut_model, decision = newest(facts)
    episode = -1 if decision is None else int(cut_model["episode"])
    through = _through(facts)
    cuts = [None if decision is None else _slice(decision, through, i, j) for i, j in pairs]
    squares = [
        tag("div", _square(facts, cut_model, cut, through, i, j))
        for cut, (i, j) in zip(cuts, pairs, strict=True)
    ]
    entries = [("dot ok", "success"), ("dot bad ring", "failure"), ("advised dot", "recommended")]
    if cut_model.get("mixture") or cut_model.get("elite"):
        entries.append(("drawn", "what trials were drawn from, two deviations"))
    some = any(cut is not None and bool((cut >= 0.0).any()) for cut in cuts)
    if some:
        entries.append(("good", "what the learner takes for good"))
    return card(
        "Slices of the partition",
        tag("div", *squares, class_="squares"),
        legend(*entries),
        note=_note(facts, len(pairs), episode, some=some),
        wide=True,
    )


def newest(facts: Facts) -> tuple[dict[str, Any], Decision | None]:
    """Return the newest model whose partition takes any trial for good, and that partition.

    Where none does it is the newest model; its partition may be ``None``.
    """
    first: tuple[dict[str, Any], Decision | None] = ({}, None)
    for model in islice(facts.models(), MODELS_MAX):
        decision = decision_of(model, len(facts.names))
        if decision is not None and bool((decision(facts.u) >= 0.0).any()):
            return model, decision
        if not first[0]:
            first = model, decision
    return first


def _note(facts: Facts, pairs: int, episode: int, *, some: bool) -> str:
    which = "the parameters that matter most" if pairs > 1 else "the two parameters"
    if episode < 0:
        return f"Samples in {which}; this learner keeps no partition that could be cut."
    others = f", all others {_others(facts)}" if len(facts.names) > 2 else ""
    words = [f"The partition that episode {episode + 1} was drawn with, in {which}{others}."]
    if not some:
        words.append("On none of these slices does it take anything for good.")
    if episode < facts.episodes.number[-1]:
        words.append("Later ones take no trial for good.")
    if len(facts.names) > 2:
        words.append("Samples are strong where they lie near the slice, faint where they do not.")
    return " ".join(words)


def _others(facts: Facts) -> str:
    return "as recommended" if facts.advice is not None else "at the mean of the successes"


def _through(facts: Facts) -> Array:
    """Return the point ``(n,)`` that slices go through: the recommended one, or the best mean."""
    if facts.advice is not None:
        return np.asarray(np.clip(facts.unit_of(facts.advice.theta), 0.0, 1.0))
    won = facts.u[facts.success]
    middle: Array = won.mean(axis=0) if len(won) else np.full(len(facts.names), 0.5)
    return middle


def _square(
    facts: Facts, model: dict[str, Any], values: Array | None, through: Array, i: int, j: int
) -> Markup:
    layers: list[Markup | None] = []
    if values is not None:
        layers += [
            path("good", "".join(_polygon(polygon) for polygon in positive(values))),
            path(
                "good-edge", "".join(marks.line(*zip(a, b, strict=True)) for a, b in zero(values))
            ),
        ]
    layers += _samples(facts, through, i, j)
    layers += [path("drawn", marks.line(*e.T)) for e in ellipses(model, i, j, len(through))]
    if facts.advice is not None:
        layers += [
            path("advised dot halo", marks.dots(through[i], through[j])),
            path("advised dot", marks.dots(through[i], through[j]), "the recommended tuple"),
        ]
    x, y = _axis(facts, i), _axis(facts, j)
    return plot(layers, x, y, f"slice in {x.label} and {y.label}", shape="square")


def _slice(decision: Decision, through: Array, i: int, j: int) -> Array:
    side = np.linspace(0.0, 1.0, GRID)
    points = np.repeat(through[None, :], GRID * GRID, axis=0)
    points[:, i], points[:, j] = np.repeat(side, GRID), np.tile(side, GRID)
    return decision(points).reshape(GRID, GRID)


def _samples(facts: Facts, through: Array, i: int, j: int) -> list[Markup | None]:
    """Return four paths: failures and successes, far from the slice and near it."""
    others = np.delete(np.arange(len(facts.names)), [i, j])
    away = np.linalg.norm(facts.u[:, others] - through[others], axis=1)
    near = away <= np.quantile(away, 1.0 / 3.0) if others.size else np.ones(len(away), dtype=bool)
    layers: list[Markup | None] = []
    for place, which in (("far", ~near), ("near", near)):
        for kind, mask in (("bad", facts.failure), ("ok", facts.success)):
            points = np.clip(facts.u[mask & which], 0.0, 1.0)
            data = marks.dots(points[:, i], points[:, j])
            layers.append(path(f"dot small {kind} {place}", data))
            if kind == "bad":
                layers.append(path("hole small", data))
    return layers


def _axis(facts: Facts, i: int) -> Axis:
    low, high = (float(bound[i]) for bound in facts.bounds)
    unit = f" [{facts.units[i]}]" if facts.units[i] else ""
    scale = Scale(low, high)
    return Axis(scale, f"{facts.names[i]}{unit}")


def _polygon(points: list[tuple[float, float]]) -> str:
    x, y = zip(*points, strict=True)
    return marks.line(x, y) + "Z"
