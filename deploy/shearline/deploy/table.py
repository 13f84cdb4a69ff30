"""The live table: a status message drawn for people. Knows rich and nothing else."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from shearline.protocol.messages import EpisodeClosed, EvaluatorState, Purpose, Status

#: Episodes shown at once; the last ones matter.
EPISODES_SHOWN = 12
#: Evaluators shown at once.
EVALUATORS_SHOWN = 16
#: Trials named for each of them; the rest is counted.
TRIALS_SHOWN = 4
STATE_STYLE = {
    "busy": "green", "idle": "cyan", "resting": "yellow", "silent": "red", "gone": "red",
    "left": "dim",
}  # fmt: skip


def render(status: Status) -> RenderableType:
    """Draw the run: headline, progress, episodes and evaluators."""
    return Group(
        _headline(status),
        _progress(status),
        _steps(status),
        _episodes(status),
        _evaluators(status.evaluators),
    )


def time_left_s(status: Status) -> float:
    """Return the time left at the present rate [s]; infinite while nothing is known."""
    left = trials_asked(status) - status.counted - status.lost
    return left / status.rate_hz if status.rate_hz > 0.0 else math.inf


def trials_asked(status: Status) -> int:
    """Return how many trials the whole run has, those that only confirm among them."""
    return status.episodes * status.trials_per_episode + status.confirming


def episode_name(episode: EpisodeClosed, episodes: int) -> str:
    """Return what people call a closed episode: ``episode 3/10``, or what its trials confirm."""
    if episode.purpose is Purpose.LEARNING:
        return f"episode {episode.episode + 1}/{episodes}"
    return "confirmation" if episode.purpose is Purpose.CONFIRMATION else "region"


def duration(time_s: float) -> str:
    """Write a duration for people: ``"2:05"``, or ``"-"`` where it is not known."""
    if not math.isfinite(time_s):
        return "-"
    minutes, rest_s = divmod(round(time_s), 60)
    return f"{minutes}:{rest_s:02d}"


def number(value: float | None, digits: int = 3) -> str:
    """Write a number for people, or ``"-"`` where there is none."""
    return "-" if value is None or not math.isfinite(value) else f"{value:.{digits}f}"


def _headline(status: Status) -> Text:
    losses = {
        "lost": status.lost,
        "late": status.late,
        "duplicates": status.duplicates,
        "aborted": status.aborted,
        "rejected": status.rejected,
        "malformed": status.malformed,
        "dropped": status.dropped,
    }
    said = [f"{count} {name}" for name, count in losses.items() if count]
    text = Text.assemble((status.run, "bold"), f"  {status.task}, {status.learner}, {status.state}")
    return text.append("  " + ", ".join(said), style="yellow") if said else text


def _progress(status: Status) -> Table:
    row = Table.grid(padding=(0, 2))
    total = max(1, trials_asked(status))
    done = status.counted + status.lost
    row.add_row(
        ProgressBar(total=total, completed=min(done, total), width=40),
        f"{status.counted} of {total} trials counted",
        f"{status.rate_hz:.2f} trials/s",
        f"{duration(time_left_s(status))} left",
    )
    return row


def _steps(status: Status) -> Text:
    """Say what the learner's owner thread takes for one step, the waits of others not counted."""
    return Text(
        f"learner: a step takes at most {status.step_cpu_ms_max:.1f} ms of processor time"
        f" (99 %: {status.step_cpu_ms_p99:.2f} ms), {status.step_ms_max:.1f} ms by the wall",
        style="dim",
    )


def _episodes(status: Status) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2))
    for name in ("episode", "success", "", "mean cost", "best cost"):
        table.add_column(name, justify="left" if not name else "right")
    for episode in status.history[-EPISODES_SHOWN:]:
        table.add_row(*_episode_row(episode, status.episodes))
    return table


def _episode_row(episode: EpisodeClosed, episodes: int) -> tuple[RenderableType, ...]:
    return (
        episode_name(episode, episodes).removeprefix("episode "),
        f"{episode.success_rate:.0%}",
        ProgressBar(total=1.0, completed=episode.success_rate, width=20),
        number(episode.mean_cost),
        number(episode.best_cost),
    )


def _evaluators(evaluators: list[EvaluatorState]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2))
    for name in ("evaluator", "state", "trials", "lease", "done", "lost"):
        table.add_column(name, justify="right" if name in {"lease", "done", "lost"} else "left")
    for one in evaluators[:EVALUATORS_SHOWN]:
        table.add_row(
            one.evaluator,
            Text(one.state, style=STATE_STYLE.get(one.state, "")),
            _trials(one),
            "-" if one.lease_s is None else f"{one.lease_s:.1f} s",
            str(one.done),
            str(one.lost),
        )
    if len(evaluators) > EVALUATORS_SHOWN:
        table.add_row(f"and {len(evaluators) - EVALUATORS_SHOWN} more", "", "", "", "", "")
    return table


def _trials(one: EvaluatorState) -> str:
    """Name the trials an evaluator holds."""
    named = [str(number) for number in one.trials[:TRIALS_SHOWN]]
    more = one.running - len(named)
    return ", ".join(named) + (f" and {more} more" if more > 0 else "") if named else "-"
