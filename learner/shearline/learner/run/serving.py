"""The run: where dispatcher, learner, journal and network are put together and let go again.

The thread that calls :func:`serve` becomes the owner of the run; callbacks of the network only
enqueue, and fits happen in the fitter's thread.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from shearline.learner.base import Learner
from shearline.learner.dispatcher import Dispatcher
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.registry import create, resolve
from shearline.learner.run.config import RunConfig
from shearline.learner.run.doorman import Doorman
from shearline.learner.run.fitter import Fitter
from shearline.learner.run.folder import Folder, logged_to
from shearline.learner.run.inbox import Inbox
from shearline.learner.run.namesake import refuse_namesake
from shearline.learner.run.outgoing import Outgoing
from shearline.learner.run.owner import Owner
from shearline.learner.run.signals import signals_to
from shearline.learner.run.summary import RunSummary, summarise
from shearline.learner.run.tokens import tokens
from shearline.protocol.keys import Keys
from shearline.protocol.link import Link, open_router
from shearline.protocol.messages import Status
from shearline.protocol.switching import quick_switching

_log = logging.getLogger("shearline.learner")


def serve(
    config: RunConfig,
    run_dir: Path,
    listen: str,
    *,
    resume: bool = False,
    on_status: Callable[[Status], None] | None = None,
    on_listening: Callable[[], None] | None = None,
    settings: Mapping[str, object] | None = None,
) -> RunSummary:
    """Lead a run to its end.

    Args:
        config: What is asked for.
        run_dir: The run's folder; its name is the run's name. If it holds an unfinished run of
            the same configuration, that is resumed.
        listen: Endpoint for evaluators, e.g. ``"tcp/0.0.0.0:7447"``.
        resume: Insist on there being something to resume.
        on_status: Called in this thread with each status, twice a second.
        on_listening: Called in this thread once the learner is alive to others, before it acts on
            what they say.
        settings: Further Zenoh settings by path (TLS, access control).

    Returns:
        The summary, also written to ``summary.json``. SIGINT and SIGTERM stop the run (twice: at
        once) and leave it to be resumed.

    Raises:
        ConfigError: If the folder holds a finished or another run, or there is none to resume,
            or no learner has that name, or another learner leads a run of this name.
        RecordError: If the folder or journal cannot be read or written, or is in use.
        LinkError: If the endpoint is taken or malformed.
    """
    resolve(config.learner)
    keys = Keys(run_dir.resolve().name)
    started_s = time.monotonic()
    with Folder(run_dir, config, resume=resume) as folder, logged_to(run_dir / "learner.log"):
        if folder.damage():
            _log.warning("%s", folder.damage())
        dispatcher = Dispatcher(config.rules(), tokens().__next__, folder.book)
        with open_router(listen, settings=settings) as link:
            if settings and "connect/endpoints" in settings:
                refuse_namesake(link, keys)
            intake = link.intake(keys.from_evaluators(), keys.wake())
            inbox = Inbox(intake, Doorman(dispatcher.desk))
            owner = _owner(config, folder, keys, dispatcher, link, inbox, on_status)
            with signals_to(inbox), quick_switching(), intake.woken_every(owner.tick_s):
                epoch = owner.begin()
                _listen(link, keys, inbox, epoch)
                if on_listening is not None:
                    on_listening()
                owner.run()
        summary = summarise(
            config,
            owner.dispatcher.desk,
            owner.recommendation,
            run=keys.run,
            wall_s=time.monotonic() - started_s,
            vitals=owner.vitals(),
            ending=owner.ending,
            why=owner.why,
        )
        folder.finish(summary)
    return summary


def _owner(
    config: RunConfig,
    folder: Folder,
    keys: Keys,
    dispatcher: Dispatcher,
    link: Link,
    inbox: Inbox,
    on_status: Callable[[Status], None] | None,
) -> Owner:
    def make() -> Learner:
        learner = create(
            config.learner,
            config.space,
            episode_length=config.trials,
            seed=config.seed,
            **config.switches,
        )
        if config.warm_start and isinstance(learner, EpisodicLearner):
            learner.prime(config.warm_start)
        return learner

    return Owner(
        config,
        keys.run,
        dispatcher,
        folder.journal,
        Fitter(make, config.seed, inbox),
        Outgoing(link, keys, record=config.record),
        inbox,
        on_status,
    )


def _listen(link: Link, keys: Keys, inbox: Inbox, epoch: int) -> None:
    """Hear evaluators and operator; say last that the learner is there."""
    link.subscribe(keys.op_cmd(), inbox)
    link.watch(keys.live_evaluators(), inbox)
    link.announce(keys.live_learner(epoch))
