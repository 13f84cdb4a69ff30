"""How the protocol fared: what was lost, late, said twice or aborted, and by whom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shearline.protocol.codec import decode
from shearline.protocol.errors import ProtocolError
from shearline.protocol.messages import JUDGED, Result, Wire
from shearline.record.reader import Run
from shearline.record.report.facts import Facts
from shearline.record.report.markup import Markup, join, tag
from shearline.record.report.plot import card
from shearline.record.report.words import count, number, quantity

#: What each count means, in the order of the table.
COUNTS = {
    "counted": "trials with exactly one outcome",
    "lost": "trials whose attempts were used up without one",
    "late": "outcomes that came after their episode had closed",
    "duplicates": "results said again, or by a second evaluator; ignored",
    "aborted": "attempts that a robot, an operator or an engine broke off",
    "rejected": "attempts out of an evaluator's own bounds",
}
#: Likewise, of messages; only the last epoch's are known.
MESSAGES = {
    "malformed": "messages that the protocol does not allow",
    "dropped": "messages that found the learner's inbox crowded",
}
#: These should be nothing.
TROUBLES = ("lost", "late", "aborted", "rejected", "malformed", "dropped")


@dataclass(frozen=True, slots=True)
class Abort:
    """Attempts that ended alike without a verdict.

    Attributes:
        kind: ``aborted`` or ``rejected``.
        why: What the evaluator said.
        trials: Of each attempt, in order of time.
    """

    kind: str
    why: str
    trials: tuple[int, ...]


def counts(facts: Facts) -> dict[str, int]:
    """Return the counts of a run, from its summary or its last status; empty if it has neither."""
    status, summary = facts.run.status, facts.summary
    if all(name in summary for name in COUNTS):
        found = {name: int(summary[name]) for name in COUNTS}
    elif status is not None:
        found = {name: int(getattr(status, name)) for name in COUNTS}
    else:
        return {}
    return found | {name: int(getattr(status, name, 0)) for name in MESSAGES}


def aborts(run: Run) -> list[Abort]:
    """Return the attempts without a verdict by kind and reason, the most frequent first."""
    found: dict[tuple[str, str], dict[str, int]] = {}
    for _, wire in run.messages("/wire"):
        assert isinstance(wire, Wire)
        if wire.sent or not wire.key.endswith("/result"):
            continue
        try:
            result = decode(wire.payload, Result)
        except ProtocolError:
            continue  # the learner did not understand it either
        if result.kind not in JUDGED:
            found.setdefault((result.kind.value, result.why), {})[result.token] = result.trial
    ordered = sorted(found.items(), key=lambda item: (-len(item[1]), item[0]))
    return [Abort(kind, why, tuple(tokens.values())) for (kind, why), tokens in ordered]


def picture(facts: Facts) -> Markup:
    """Return the counts of a run and what is behind them."""
    title = "Protocol health"
    said = counts(facts)
    parts: list[Markup | None] = [_damage(facts.damage)]
    if said:
        parts.append(_table(said))
        if said["aborted"] or said["rejected"]:
            parts.append(_aborts(aborts(facts.run)))
    note = _note(facts) if said else "The record has no status: the run had hardly begun."
    return card(title, *parts, note=note)


def _table(said: dict[str, int]) -> Markup:
    rows = [
        tag(
            "tr",
            tag("th", name, scope="row"),
            tag("td", str(said[name]), class_="n trouble" if _bad(name, said) else "n"),
            tag("td", meaning, class_="faint"),
        )
        for name, meaning in (COUNTS | MESSAGES).items()
    ]
    return tag("table", tag("tbody", *rows), class_="health")


def _bad(name: str, said: dict[str, int]) -> bool:
    return name in TROUBLES and said[name] > 0


def _aborts(found: Sequence[Abort]) -> Markup:
    items = (
        tag(
            "li",
            f"{count(len(a.trials), 'attempt')} {a.kind}: {a.why or 'no reason given'}"
            f" (last of trial {a.trials[-1]})",
        )
        for a in found[:20]
    )
    return tag("ul", *items, class_="sentences")


def _damage(sentences: Sequence[str]) -> Markup | None:
    if not sentences:
        return None
    head = tag("b", "The record is damaged. ")
    return tag("div", head, join(tag("p", sentence) for sentence in sentences), class_="alarm")


def _note(facts: Facts) -> str:
    status = facts.run.status
    who = {state.evaluator for state in facts.run.evaluators}
    words = [f"{count(len(who), 'evaluator')} took part."]
    if status is not None:
        if status.epoch > 1:
            words.append(f"The learner was started {number(status.epoch)} times.")
        words.append(f"Its longest step took {quantity(status.step_ms_max, 'ms')}.")
    return " ".join(words)
