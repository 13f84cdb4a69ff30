"""A replayed trial in words and as JSON: what was on record, what came out, what was changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from shearline.evaluator.replay import Change, Replayed, Verification
from shearline.protocol.messages import JUDGED

#: Width of the names and of each column of values.
NAME, VALUE = 14, 22


def as_json(replayed: Replayed, change: Change, verified: Verification | None) -> dict[str, Any]:
    """Return a replayed trial for programs.

    Keys: ``trial, identical, why, changed`` (by name), ``theta, seed, engine, recorded, replayed``;
    the last two have ``outcome, cost, why, extras, digest`` or are ``None``. ``identical`` is
    ``None`` where there is nothing to compare.
    """
    names = list(replayed.case.task.space)
    return {
        "trial": replayed.case.trial,
        "identical": verified.identical if verified else None,
        "why": verified.why if verified else "",
        "changed": dict(change.values),
        "theta": dict(zip(names, replayed.theta, strict=True)),
        "seed": replayed.seed,
        "engine": replayed.engine,
        "recorded": _recorded(replayed),
        "replayed": _replayed(replayed),
    }


def verified_json(verified: Verification) -> dict[str, Any]:
    """Return a verification for programs."""
    return {
        "trial": verified.trial,
        "identical": verified.identical,
        "digest_recorded": verified.digest_recorded,
        "digest_replayed": verified.digest_replayed,
        "why": verified.why,
    }


def lines(replayed: Replayed, change: Change, verified: Verification | None) -> Iterator[str]:
    """Yield a replayed trial for people, line by line."""
    case = replayed.case
    yield f"trial {case.trial} of {case.task.name} on {replayed.engine}"
    yield from _changes(replayed, change)
    recorded, here = _recorded(replayed) or {}, _replayed(replayed)
    yield f"{'':{NAME}}{'recorded':<{VALUE}}{'replayed'}"
    for name in ("outcome", "why", "cost"):
        yield from _row(name, recorded.get(name), here[name])
    for name, value in here["extras"].items():
        yield from _row(name, recorded.get("extras", {}).get(name), value)
    if verified is not None:
        yield sentence(verified)


def sentence(verified: Verification) -> str:
    """Say in one sentence whether a trial came out again."""
    if verified.identical:
        though = f", though {verified.why}" if verified.why else ""
        return f"trial {verified.trial} came out identical to the last bit{though}"
    return f"trial {verified.trial} did not come out again: {verified.why}"


@dataclass(frozen=True, slots=True)
class Summary:
    """How the verification of a whole run went; its fields are the last line of JSON.

    Attributes:
        run: Name of the run.
        trials: How many were verified.
        identical: How many of them came out again.
        different: Numbers of those that did not come out again.
        left_out: Why others could not be verified, and how many.
        workers: Processes that ran them.
        wall_s: How long it took [s].
    """

    run: str
    trials: int
    identical: int
    different: list[int]
    left_out: dict[str, int]
    workers: int
    wall_s: float

    def __str__(self) -> str:
        """Say it in one line."""
        rest = f"; left out: {counted(self.left_out)}" if self.left_out else ""
        processes = "1 process" if self.workers == 1 else f"{self.workers} processes"
        return (
            f"{self.identical} of {self.trials} trials came out identical to the"
            f" last bit ({processes}, {self.wall_s:.0f} s){rest}"
        )


def counted(reasons: Mapping[str, int]) -> str:
    """Say how many trials were left out, and why."""
    return ", ".join(f"{count} {why}" for why, count in reasons.items()) or "it has no trials"


def _changes(replayed: Replayed, change: Change) -> Iterator[str]:
    space = replayed.case.task.space
    recorded = dict(zip(space, replayed.case.theta, strict=True))
    for name, value in change.values.items():
        here = f"{value:g} {space[name][0]}".rstrip()
        yield f"with {name} {here} instead of {recorded[name]:.6g}"
    if change.seed is not None:
        yield f"with seed {change.seed} instead of {replayed.case.seed}"


def _row(name: str, recorded: object, here: object) -> Iterator[str]:
    was, now = _short(recorded), _short(here)
    if was or now:
        yield f"{name:{NAME}}{was or '-':<{VALUE}}{now or '-'}"


def _short(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _recorded(replayed: Replayed) -> dict[str, Any] | None:
    outcome = replayed.case.outcome
    if outcome is None or outcome.kind is None:
        return None
    return {
        "outcome": outcome.kind.value,
        "cost": outcome.cost,
        "why": outcome.why,
        "extras": dict(outcome.extras),
        "digest": replayed.case.digest,
    }


def _replayed(replayed: Replayed) -> dict[str, Any]:
    verdict = replayed.verdict
    judged = verdict.kind in JUDGED
    return {
        "outcome": verdict.kind.value,
        "cost": verdict.cost if judged else None,
        "why": verdict.why,
        "extras": dict(verdict.extras),
        "digest": replayed.digest,
    }
