"""What failed, when, and which trial to look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.record.report import marks
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, join, tag
from shearline.record.report.plot import Axis, card, legend, path, plot
from shearline.record.report.scale import Scale
from shearline.record.report.success import episode_axis
from shearline.record.report.words import count, share

#: Kinds that get a colour of their own; the rest are shown together.
COLOURS = 5


@dataclass(frozen=True, slots=True)
class Kind:
    """Trials that failed alike.

    Attributes:
        why: The task's word, or ``"lost: ..."``.
        members: Rows of the table, in order.
    """

    why: str
    members: npt.NDArray[np.intp]


def kinds(facts: Facts) -> list[Kind]:
    """Return the kinds of failure, the most frequent first; lost trials come last."""
    why = facts.table["why"]
    named = {
        str(word): np.flatnonzero(facts.failure & (why == word))
        for word in np.unique(why[facts.failure])
    }
    failed = sorted(
        (Kind(word or "unnamed", members) for word, members in named.items()),
        key=lambda kind: (-len(kind.members), kind.why),
    )
    lost = np.flatnonzero(facts.lost)
    return failed + ([Kind("lost", lost)] if len(lost) else [])


def picture(facts: Facts) -> Markup:
    """Return failures over episodes and a table of their kinds."""
    title = "What failed and why"
    found = kinds(facts)
    if not found:
        said = count(int(facts.learning.sum()), "trial")
        return card(title, note=f"Nothing: {said}, and none of them failed or was lost.")
    trial = facts.table["trial"][found[0].members[-1]]
    note = join(
        [
            "The trial to look at is the latest of its kind, the nearest to what is tried now: ",
            tag("code", f"shearline view {facts.path} --trial {trial}"),
            ".",
        ]
    )
    return card(title, _chart(facts, found), _table(facts, found), note=note)


def _chart(facts: Facts, found: Sequence[Kind]) -> Markup:
    episode = facts.table["episode"]
    episodes = int(episode[facts.learning].max()) + 1
    groups = [(kind.why, kind.members) for kind in found[:COLOURS]]
    if len(found) > COLOURS:
        rest = np.concatenate([kind.members for kind in found[COLOURS:]])
        groups.append(("others", rest))
    counts = np.stack([np.bincount(episode[rows], minlength=episodes) for _, rows in groups])
    tops = np.cumsum(counts, axis=0)
    y = Axis(Scale(0.0, max(float(tops.max()) * 1.05, 1.0)), "trials that failed", _whole(tops))
    x = episode_axis(episodes)
    numbers = np.arange(1, episodes + 1)
    left, right = x.scale.place(numbers - 0.36), x.scale.place(numbers + 0.36)
    layers = []
    for k, (_, top) in enumerate(zip(groups, tops, strict=True)):
        some = counts[k] > 0
        bottom = y.scale.place((top - counts[k])[some])
        bars = marks.bars(left[some], right[some], bottom, y.scale.place(top[some]))
        layers.append(path(f"bar c{k}", bars))
    keys = legend(*((f"c{k}", why) for k, (why, _) in enumerate(groups)))
    about = "failures of each episode: " + ", ".join(f"{len(rows)} {why}" for why, rows in groups)
    return join([plot(layers, x, y, about, shape="low"), keys])


def _whole(tops: np.ndarray) -> list[tuple[float, str]]:
    ticks = Scale(0.0, max(float(tops.max()), 1.0)).ticks(3)
    return [(tick, f"{tick:.0f}") for tick in ticks if tick == round(tick)]


def _table(facts: Facts, found: Sequence[Kind]) -> Markup:
    head = ("why", "trials", "share", "episodes", "look at")
    rows = [_row(facts, kind) for kind in found]
    return tag(
        "table",
        tag("thead", tag("tr", *(tag("th", word, scope="col") for word in head))),
        tag("tbody", *rows),
        class_="numbers",
    )


def _row(facts: Facts, kind: Kind) -> Markup:
    table = facts.table
    episodes = table["episode"][kind.members] + 1
    first, last = int(episodes.min()), int(episodes.max())
    return tag(
        "tr",
        tag("th", kind.why, scope="row"),
        tag("td", str(len(kind.members)), class_="n"),
        tag("td", share(len(kind.members) / int(facts.learning.sum())), class_="n"),
        tag("td", str(first) if first == last else f"{first} to {last}", class_="n"),
        tag("td", f"trial {table['trial'][kind.members[-1]]}", class_="n"),
    )
