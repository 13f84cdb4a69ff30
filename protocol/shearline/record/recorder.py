"""The recorder: a process of its own that writes what observers hear into the run folder.

It is a client of the learner's session like any other observer, so it can be slow, stopped or
killed without anyone noticing; what it cannot write in time it drops and says so. It ends when
the run has ended, when the run falls silent, or when it is told to. It never speaks to anyone.

Run as ``python -m shearline.record.recorder --connect tcp/127.0.0.1:7447 --run NAME --out DIR``;
one line ``recording`` on standard output says that from now on nothing is missed.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from shearline.protocol import codec
from shearline.protocol.errors import ProtocolError, ShearlineError
from shearline.protocol.keys import Keys
from shearline.protocol.link import open_client
from shearline.protocol.messages import Message, Status
from shearline.record.foxglove import Level
from shearline.record.head import config_of
from shearline.record.inbox import Dropped, Inbox
from shearline.record.seal import seal_all
from shearline.record.writer import RecordWriter

#: A learner speaks twice a second; this long without a word it is gone for good.
SILENCE_S = 30.0
#: Once its liveliness token is gone, the next life of the learner brings its own recorder.
GONE_S = 5.0
#: After the run's end, traces may still be on their way from evaluators: wait until all is quiet.
QUIET_S = 0.5
#: ... but not for ever.
GRACE_S = 5.0
#: A learner that is there is heard of within milliseconds; do not insist on one [s].
HEARD_S = 2.0
#: Pause between looks at the clock while nothing comes [s].
TICK_S = 0.1


def record_run(
    connect: str,
    run: str,
    run_dir: Path,
    *,
    silence_s: float = SILENCE_S,
    stopped: Callable[[], bool] = lambda: False,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """Record one run until it ends, falls silent or ``stopped`` says so.

    Args:
        connect: The learner's endpoint.
        run: Name of the run, as in its keys.
        run_dir: The run folder; must exist. Torn parts of an earlier recorder are sealed first.
        silence_s: How long to wait for a word from the learner [s].
        stopped: Asked ten times a second.
        ready: Called once everything said from now on will be recorded.

    Raises:
        LinkError: If nobody answers at ``connect``.
        RecordError: If the record cannot be begun.
    """
    seal_all(run_dir)
    inbox = Inbox()
    with open_client(connect, silence_s, cancelled=stopped) as link:
        link.subscribe(Keys(run).observed(), inbox)
        link.watch(Keys(run).live_learners(), inbox)
        with RecordWriter(run_dir, config_of(run, run_dir)) as writer:
            inbox.wait_for_learner(HEARD_S)
            ready()
            _Recorder(inbox, writer, silence_s, stopped).work()


class _Recorder:
    """The loop: take an item, write it, look at the clock."""

    def __init__(
        self,
        inbox: Inbox,
        writer: RecordWriter,
        silence_s: float,
        stopped: Callable[[], bool],
    ) -> None:
        self._inbox = inbox
        self._writer = writer
        self._silence_s = silence_s
        self._stopped = stopped
        self._heard_s = time.monotonic()
        self._ended_s: float | None = None
        self._alive_s: float | None = None
        self._refused = 0

    def work(self) -> None:
        while (why := self._why_end()) is None:
            item = self._inbox.get(TICK_S)
            if item is not None:
                self._heard_s = time.monotonic()
                self._take(item.payload, item.at_ns)
            self._writer.tick(time.time_ns())
            self._say_dropped()
        self._log(Level.INFO, why)

    def _take(self, payload: bytes, at_ns: int) -> None:
        try:
            message: Message = codec.decode(payload, *codec.TO_OBSERVER)
        except ProtocolError as error:
            self._refused += 1
            if self._refused & (self._refused - 1) == 0:  # the 1st, 2nd, 4th, 8th, ...
                self._log(Level.WARNING, f"{self._refused} messages refused so far; last: {error}")
            return
        if isinstance(message, Status) and message.state == "ended":
            self._ended_s = self._ended_s or time.monotonic()
        said_s = getattr(message, "at_s", 0.0)
        publish_ns = int(said_s * 1e9) if said_s else None
        self._writer.write(message, log_ns=at_ns, publish_ns=publish_ns)

    def _why_end(self) -> str | None:
        now_s = time.monotonic()
        quiet_s = now_s - self._heard_s
        if self._stopped() and quiet_s > TICK_S:
            return "told to stop"
        if self._ended_s is not None and (quiet_s > QUIET_S or now_s - self._ended_s > GRACE_S):
            return "the run has ended"
        if self._inbox.any_learner():
            self._alive_s = now_s
        elif self._alive_s is not None and now_s - self._alive_s > GONE_S and quiet_s > GONE_S:
            return "the learner is gone"
        if quiet_s > self._silence_s:
            return f"no word from the learner for {self._silence_s:g} s"
        return None

    def _say_dropped(self) -> None:
        for dropped, what in zip(self._inbox.take_dropped(), ("traces", "messages"), strict=True):
            if dropped.count:
                self._log(Level.WARNING, _drop_sentence(dropped, what))

    def _log(self, level: Level, text: str) -> None:
        self._writer.log(level, text, log_ns=time.time_ns())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the recorder as a program; return its exit code (0, 3 could not connect, 4 failed)."""
    parser = argparse.ArgumentParser(prog="shearline.record.recorder", description="Record a run.")
    parser.add_argument("--connect", required=True, help="the learner's endpoint")
    parser.add_argument("--run", required=True, help="name of the run")
    parser.add_argument("--out", required=True, type=Path, help="the run folder")
    parser.add_argument("--silence", type=float, default=SILENCE_S, help="patience [s]")
    asked = parser.parse_args(arguments)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    os.nice(5)  # whoever runs trials comes first
    try:
        record_run(
            asked.connect,
            asked.run,
            asked.out,
            silence_s=asked.silence,
            stopped=stop.is_set,
            ready=_say_ready,
        )
    except ShearlineError as error:
        print(error, file=sys.stderr)  # noqa: T201 - a program's one sentence
        return 3 if type(error).__name__ == "LinkError" else 4
    return 0


def _say_ready() -> None:
    # whoever started us may be gone: that must not end the recording
    try:
        print("recording", flush=True)  # noqa: T201 - the line that the learner waits for
    except OSError:
        sys.stdout = None


def _drop_sentence(dropped: Dropped, what: str) -> str:
    return (
        f"dropped the oldest {dropped.count} {what} ({dropped.total_bytes / 1e6:.1f} MB):"
        " the disk is slower than the run"
    )


if __name__ == "__main__":
    sys.exit(main())
