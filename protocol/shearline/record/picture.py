"""Draws a run into a Rerun stream, message by message, from a file or live alike.

Timelines: ``trial`` counts trials, so that the cursor on trial 37 shows everything of trial 37
(its card, its curves, its path in space) and every plot is over trials; ``rank`` has the same
trials in order of cost, successes first; ``played`` lays them end to end on their own clocks, to
play them one after another. Nothing here reads files, starts a viewer, or knows which task it
draws.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from shearline.protocol.messages import (
    Counted,
    EpisodeClosed,
    EvaluatorState,
    OutcomeKind,
    Purpose,
    Snapshot,
)
from shearline.protocol.scene import SceneData
from shearline.record import charts, columns
from shearline.record.card import card
from shearline.record.goal import Goal
from shearline.record.palette import BLUE, COLOURS, GREEN, RED
from shearline.record.panels import Panels
from shearline.record.played import Played
from shearline.record.reader import Trace
from shearline.record.sheet import Sheet, Times
from shearline.record.slices import Slices
from shearline.record.space import Space
from shearline.record.topics import RunConfig

#: Points of all trials' curves together that a viewer shows without a pause: with more trials,
#: each gets fewer.
POINTS_ALL = 60_000
POINTS_MIN = 100


class Picture:
    """A run as it is drawn.

    Args:
        stream: Where to draw; owned by the caller.
        config: What was asked for, if known: names and units of parameters, limits.
        scene: What trials look like, if known.
        n_trials: How many are to be drawn, roughly: more of them are drawn more sparsely.
        ranks: Place of each trial in order of cost, where all are known.
    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        config: RunConfig | None,
        *,
        scene: SceneData | None = None,
        n_trials: int = 0,
        ranks: Mapping[int, int] | None = None,
    ) -> None:
        settings = tomllib.loads(config.text) if config else {}
        self._sheet = Sheet(stream)
        self._config = config
        self._ranks = ranks or {}
        self._limits = columns.limits_of(settings)
        self._points = points_for(n_trials)
        self._best = np.inf
        self._outcomes: dict[int, OutcomeKind | None] = {}
        self._tuples: dict[tuple[str, tuple[str, ...], int], list[list[float]]] = {}
        self._last_trial = 0
        self._last_of: dict[int, int] = {}  # episode to its last trial with an outcome
        self._goal = Goal.of(settings)
        self._panels = Panels(self._sheet)
        self._slices = Slices(self._sheet, config)
        self._styles()
        self.see(scene)

    def flush(self) -> None:
        """Hand what was drawn to the stream; nothing is seen before."""
        self._parameters()
        self._played.flush()
        self._sheet.flush()

    def see(self, scene: SceneData | None) -> None:
        """Learn what trials look like; before any is drawn."""
        self._space = Space(self._sheet, "scene", scene, self._goal)
        self._space.style()
        self._played = Played(self._sheet, self._space, self._points)

    def outcome(self, counted: Counted) -> None:
        """Draw the outcome of one trial: its card, and its points if it was there to learn from."""
        self._outcomes[counted.trial] = counted.kind
        self._last_trial = max(self._last_trial, counted.trial)
        last = self._last_of.get(counted.episode, counted.trial)
        self._last_of[counted.episode] = max(last, counted.trial)
        at = {**self._at(counted.trial), "clock": counted.at_s}
        self._sheet.row("card", at, rr.TextDocument, text=[card(counted, self._config)])
        if counted.kind is None or counted.purpose is not Purpose.LEARNING:
            return
        kind = counted.kind.value
        self._scalar(f"cost/{kind}", at, counted.cost)
        if counted.kind is OutcomeKind.SUCCESS and counted.cost < self._best:
            self._best = counted.cost
        if np.isfinite(self._best):
            # over ranks, the best so far would be the first of them all along
            self._scalar("cost/best", {"trial": counted.trial, "clock": counted.at_s}, self._best)
        found = self._tuples.setdefault((kind, tuple(at), len(counted.theta)), [])
        found.append([*at.values(), *counted.theta])

    def episode(self, closed: EpisodeClosed) -> None:
        """Draw what an episode came to, at its last trial, with one standard error.

        Only learning is drawn: a recommendation that is tried again and again, or its region drawn
        from, would look like a leap of it.
        """
        if closed.purpose is not Purpose.LEARNING:
            return
        last = self._last_of.get(closed.episode, self._last_trial)
        self._sheet.stream.set_time("trial", sequence=last)
        self._sheet.stream.set_time("clock", timestamp=closed.at_s)
        # Agresti and Coull (1998): two more of each keep the error honest at 0 and 1
        n = closed.trials + 4
        p = (closed.successes + 2) / n
        self._sheet.stream.log(
            "success_rate",
            rr.Measurements(
                values=[100.0 * closed.success_rate],
                variances=[1e4 * p * (1.0 - p) / n],
                units="%",
                names="success",
                colors=[GREEN],
                widths=[2.0],
            ),
        )
        self._sheet.stream.reset_time()
        if closed.mean_cost is not None:
            at = {"trial": last, "clock": closed.at_s}
            self._scalar("cost/episode_mean", at, closed.mean_cost)

    def snapshot(self, snapshot: Snapshot, first_trial: int | None = None) -> None:
        """Draw how the learner parts the space in an episode, from the episode's first trial on."""
        if first_trial is None:
            before = self._last_of.get(snapshot.episode - 1)
            first = self._last_trial + 1 if before is None else before + 1
        else:
            first = first_trial
        self._slices.draw(snapshot, first)

    def choose_slices(self, outcomes: Sequence[Counted]) -> None:
        """Choose the parameters of the slices by everything that is known of the run."""
        known = [
            outcome
            for outcome in outcomes
            if outcome.kind is not None and outcome.purpose is Purpose.LEARNING
        ]
        if self._config is None or not self._config.names or not known:
            return
        low, high = np.array(self._config.low), np.array(self._config.high)
        u = (np.array([outcome.theta for outcome in known]) - low) / (high - low)
        self._slices.choose(u, np.array([o.kind is OutcomeKind.SUCCESS for o in known]))

    def evaluator(self, state: EvaluatorState) -> None:
        """Draw where an evaluator stands, on the wall clock."""
        at = {"clock": state.at_s}
        self._sheet.row(f"evaluators/{state.evaluator}", at, rr.StateChange, state=[state.state])

    def trace(self, trace: Trace) -> None:
        """Draw one trial's curves, path and force."""
        if not trace.t_s.size:
            return
        self._last_trial = max(self._last_trial, trace.trial)
        thin = columns.thinned(trace, self._points)
        times = {name: np.array([at]) for name, at in self._at(trace.trial).items()}
        groups = columns.groups(thin, self._limits)
        self._panels.draw(thin, groups, times)
        self._in_space(thin, times)
        self._played.play(thin, groups, times)

    def _in_space(self, trace: Trace, times: Times) -> None:
        """Draw the whole path of the tip and the force along it, for the trial's number."""
        self._space.stand(trace.placed, columns.plain(trace), times)
        tip, force = columns.tip(trace), columns.force(trace)
        if tip is None:
            return
        self._space.path(tip, COLOURS[self._kind(trace)], times)
        if columns.in_lock(trace):
            self._space.goal()
        if force is not None:
            self._space.forces(tip, force, times)

    def _at(self, trial: int) -> dict[str, float]:
        rank = self._ranks.get(trial)
        return {"trial": trial} if rank is None else {"trial": trial, "rank": rank}

    def _scalar(self, path: str, at: Mapping[str, float], value: float) -> None:
        self._sheet.row(path, at, rr.Scalars, scalars=np.array([value]))

    def _styles(self) -> None:
        static = self._sheet.static
        static("card", rr.TextDocument.from_fields(media_type="text/markdown"))
        for kind, colour in (("success", GREEN), ("failure", RED)):
            style = rr.SeriesPoints(colors=[colour], names=[kind], marker_sizes=[3.0])
            static(f"cost/{kind}", style)
            for name in self._config.names if self._config else ():
                static(f"parameters/{name}/{kind}", style)
        static("cost/best", rr.SeriesLines(colors=[BLUE], names=["best so far"], widths=[1.5]))
        mean = rr.SeriesLines(colors=[(240, 200, 90)], names=["episode mean"], widths=[2.0])
        static("cost/episode_mean", mean)

    def _parameters(self) -> None:
        """Draw the tuples of the outcomes that wait, parameter by parameter."""
        waiting, self._tuples = self._tuples, {}
        for (kind, timelines, n_parameters), rows in waiting.items():
            table = np.array(rows)
            times = {name: table[:, i] for i, name in enumerate(timelines)}
            for i, name in enumerate(self._names(n_parameters), start=len(timelines)):
                values = table[:, i]
                self._sheet.rows(f"parameters/{name}/{kind}", times, rr.Scalars, scalars=values)

    def _names(self, n_parameters: int) -> Sequence[str]:
        if self._config and len(self._config.names) == n_parameters:
            return self._config.names
        return [f"x{i}" for i in range(n_parameters)]

    def _kind(self, trace: Trace) -> OutcomeKind | None:
        if trace.trial in self._outcomes:
            kind = self._outcomes[trace.trial]
            return kind if kind in COLOURS else None
        won = any(name == "success" for _, name in trace.events)
        return OutcomeKind.SUCCESS if won else OutcomeKind.FAILURE


def points_for(n_trials: int) -> int:
    """Return how many points each curve of a trial gets where ``n_trials`` are drawn."""
    if n_trials < 1:
        return charts.POINTS_MAX
    return min(charts.POINTS_MAX, max(POINTS_MIN, POINTS_ALL // n_trials))
