"""How long each trial took, phase by phase where its trace says so."""

from __future__ import annotations

import numpy as np

from shearline.record.report import marks
from shearline.record.report.cost import trial_axis
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup
from shearline.record.report.plot import Axis, card, legend, path, plot
from shearline.record.report.scale import holding
from shearline.record.report.words import duration


def picture(facts: Facts) -> Markup:
    """Return the phases of each traced trial, or how long each trial took by the wall."""
    if facts.run.phases:
        return _phases(facts)
    return _wall(facts)


def _phases(facts: Facts) -> Markup:
    phases = facts.run.phases
    trials = np.array(sorted(phases))
    names = list(dict.fromkeys(phase.name for n in trials for phase in phases[int(n)]))
    ends = np.array([phases[int(n)][-1].end_s if phases[int(n)] else 0.0 for n in trials])
    x, y = trial_axis(trials), Axis(holding(ends, zero=True), "time in the trial [s]")
    layers = []
    for k, name in enumerate(names):
        found = [(n, p.start_s, p.end_s) for n in trials for p in phases[int(n)] if p.name == name]
        at, start, end = (np.array(column, dtype=np.float64) for column in zip(*found, strict=True))
        left, right = x.scale.place(at - 0.5), x.scale.place(at + 0.5)
        bars = marks.bars(left, right, y.scale.place(start), y.scale.place(end))
        layers.append(path(f"bar p{k % 6}", bars))
    middle = float(np.median(ends))
    keys = legend(*((f"p{k % 6}", name) for k, name in enumerate(names)))
    about = f"phases of {len(trials)} trials, {duration(middle)} in the middle"
    note = f"On the trial's own clock; half of the trials end within {duration(middle)}."
    return card("Phases of each trial", plot(layers, x, y, about, shape="low"), keys, note=note)


def _wall(facts: Facts) -> Markup:
    title = "Time of each trial"
    wall_s = facts.table["wall_s"]
    if not len(wall_s):
        return card(title, note="No trial has run yet.")
    x = trial_axis(facts.table["trial"])
    y = Axis(holding(wall_s, zero=True, log=True), "time by the wall [s]")
    layers = [
        path("dot p1", marks.dots(x.scale.place(facts.table["trial"]), y.scale.place(wall_s)))
    ]
    middle = float(np.median(wall_s))
    about = f"time of {len(wall_s)} trials, {duration(middle)} in the middle"
    note = (
        f"These trials have no trace with phases. Half of them took less than {duration(middle)}."
    )
    return card(title, plot(layers, x, y, about, shape="low"), note=note)
