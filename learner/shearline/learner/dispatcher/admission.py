"""Who comes, who goes, and which of two processes with one name is meant.

A second boot of a name that is in use is neither welcomed nor refused at once: usually the first
has died and nobody noticed yet. If its liveliness vanishes, or it stays silent for a lease, the
newcomer takes its place. If it is still heard a lease later, both are alive, and the newcomer is
told to choose another name.
"""

from __future__ import annotations

from shearline.learner.dispatcher.desk import Desk
from shearline.learner.dispatcher.entries import AttemptReturned, LapseReason
from shearline.learner.dispatcher.events import ByeReceived, EvaluatorGone, HelloReceived
from shearline.learner.dispatcher.roster import Challenger, Evaluator
from shearline.learner.dispatcher.rules import EVALUATORS_MAX
from shearline.learner.dispatcher.states import ENDING, RunState
from shearline.protocol.messages import (
    VERSION,
    Command,
    CommandKind,
    Credit,
    Hello,
    Refused,
    Welcome,
)


def hello(desk: Desk, event: HelloReceived) -> None:
    """Welcome, refuse, or let wait."""
    name, message = event.evaluator, event.message
    known = desk.roster.get(name)
    if known is not None and known.boot == message.boot:
        if not known.left:
            _again(desk, known, message)
        return
    if desk.state in ENDING:
        desk.send(name, Refused(boot=message.boot, why="the run is ending", ended=True))
        return
    why = _objection(desk, message)
    if not why and known is not None and _is_alive(desk, known):
        if not _outlived(desk, known, message.boot):
            return
        why = (
            f"another evaluator called {name!r} is alive in this run:"
            " give this one a name of its own"
        )
    if not why:
        why = _admit(desk, name, message)
    if why:
        desk.send(name, Refused(boot=message.boot, why=why))


def bye(desk: Desk, event: ByeReceived) -> None:
    """Take back what an evaluator holds."""
    boot = event.message.boot
    for token in list(desk.book.held_by.get(event.evaluator, ())):
        if desk.book.attempts[token].boot == boot:
            desk.journal(AttemptReturned(at_s=desk.now_s, stimulus=desk.stimulus, token=token))
            del desk.leases[token]
    known = desk.roster.get(event.evaluator)
    if known is not None and known.boot == boot and not known.left:
        known.left = True
        desk.say(f"{event.evaluator} leaves: {event.message.why or 'no reason given'}")


def gone(desk: Desk, event: EvaluatorGone) -> None:
    """Stop waiting for a boot whose liveliness vanished."""
    for token in list(desk.book.held_by.get(event.evaluator, ())):
        if desk.book.attempts[token].boot == event.boot:
            desk.lapse(desk.book.attempts[token], LapseReason.GONE)
    known = desk.roster.get(event.evaluator)
    if known is not None and known.boot == event.boot and not (known.left or known.gone):
        known.gone = True
        desk.say(f"{event.evaluator} is gone")


def heard(desk: Desk, evaluator: Evaluator) -> None:
    """Note a sign of life of the boot on the roster."""
    evaluator.heard_s = desk.clock_s
    evaluator.gone = False


def credit(desk: Desk, evaluator: Evaluator, message: Credit) -> None:
    """Note how many attempts it will hold, and repeat what it must know of the run's state."""
    heard(desk, evaluator)
    if message.seq > evaluator.seq:
        evaluator.seq = message.seq
        evaluator.credits = message.credits
    remind(desk, evaluator)


def remind(desk: Desk, evaluator: Evaluator) -> None:
    """Repeat a command that the evaluator may have missed."""
    kind = _REMINDERS.get(desk.state)
    if kind is not None:
        evaluator.was_held = True
        desk.send(evaluator.name, Command(kind=kind))
    elif evaluator.was_held:
        desk.send(evaluator.name, Command(kind=CommandKind.RESUME))


_REMINDERS = {
    RunState.HELD: CommandKind.HOLD,
    RunState.STOPPING: CommandKind.STOP,
    RunState.ENDED: CommandKind.STOP,
}


def _again(desk: Desk, known: Evaluator, message: Hello) -> None:
    """A boot that is known says hello again: it missed the answer, or its task is warm now."""
    heard(desk, known)
    why = _objection(desk, message)
    if why:
        known.credits = 0
        desk.send(known.name, Refused(boot=message.boot, why=why))
        return
    known.engine = message.engine or known.engine
    _welcome(desk, known)
    remind(desk, known)


def _objection(desk: Desk, message: Hello) -> str:
    """Return why a boot cannot take part, or nothing."""
    task = desk.rules.task
    if message.version != VERSION:
        return (
            f"expected protocol version {VERSION}, got {message.version}:"
            " install the same Shearline on both sides"
        )
    if message.task_digest not in {"", desk.task_digest}:
        return (
            f"expected task {task.name!r} with digest {desk.task_digest},"
            f" got {message.task_digest}: start learner and evaluator with the same task,"
            " bounds and options"
        )
    if desk.rules.kinds and message.kind not in desk.rules.kinds:
        return (
            f"expected an evaluator of kind {' or '.join(desk.rules.kinds)}, got {message.kind!r}:"
            " this run was configured to take no other"
        )
    return ""


def _is_alive(desk: Desk, known: Evaluator) -> bool:
    silent_s = desk.clock_s - known.heard_s
    return not (known.left or known.gone) and silent_s <= desk.rules.lease_s


def _outlived(desk: Desk, known: Evaluator, boot: str) -> bool:
    """Tell whether the known boot was heard long after another one first claimed its name."""
    if known.challenger is None or known.challenger.boot != boot:
        known.challenger = Challenger(boot, desk.clock_s)
        desk.say(f"a second {known.name} says hello: waiting to see which of them is alive")
    return known.heard_s > known.challenger.since_s + desk.rules.lease_s


def _admit(desk: Desk, name: str, message: Hello) -> str:
    """Enter a new boot; return why not, or nothing."""
    newcomer = Evaluator.of(name, message, desk.clock_s)
    if not desk.roster.admit(newcomer):
        return f"{EVALUATORS_MAX} evaluators are here already: no more are admitted"
    for token in list(desk.book.held_by.get(name, ())):
        if desk.book.attempts[token].boot != message.boot:
            desk.lapse(desk.book.attempts[token], LapseReason.REPLACED)
    desk.say(f"{name} joins: {message.kind}, {message.credits} credits, {message.engine}")
    _welcome(desk, newcomer)
    return ""


def _welcome(desk: Desk, evaluator: Evaluator) -> None:
    held = desk.state is RunState.HELD
    evaluator.was_held |= held
    desk.send(
        evaluator.name,
        Welcome(
            boot=evaluator.boot,
            epoch=desk.book.epoch,
            task=desk.rules.task,
            lease_s=desk.rules.lease_s,
            held=held,
        ),
    )
