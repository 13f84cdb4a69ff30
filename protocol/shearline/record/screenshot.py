"""Takes a picture of the view without a screen, for documentation and tests.

Needs a Vulkan driver; a software one will do (Debian: mesa-vulkan-drivers, libvulkan1). Run as
``python -m shearline.record.screenshot RUN_DIR out.png --trial 41``.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
from rerun.experimental import ViewerClient

from shearline.protocol.errors import LinkError, RecordError
from shearline.record.layout import layout
from shearline.record.page import CLOCK
from shearline.record.reader import open_run
from shearline.record.view import APPLICATION, draw_all, follow, numbers, shape_of
from shearline.record.viewer import executable, free_port, quiet_environment

#: A picture that has not changed for so many looks is complete ...
STILL_LOOKS = 3
#: ... and is looked at this long at most [s].
PATIENCE_S = 60.0


def screenshot(
    run_dir: Path | str,
    path: Path | str,
    *,
    trial: int = 0,
    tab: int = 0,
    pages: Sequence[str] = (),
    at_s: float = 0.0,
) -> None:
    """Draw a run in a viewer without a window and write what it shows.

    Args:
        run_dir: The run folder.
        path: PNG file to write.
        trial: Trial under the cursor.
        tab: Which tab of the layout stands in front, from 0.
        pages: Trials to show in full; their page is tab 0.
        at_s: Where the cursor stands on a page [s].

    Raises:
        RecordError: If there is no such run, or no graphics driver.
    """
    run = open_run(run_dir)
    with _quiet(), _headless() as client:
        stream = rr.RecordingStream(APPLICATION, recording_id="screenshot")
        stream.connect_grpc(client.url)
        chosen = numbers(run, pages)
        draw_all(stream, run, chosen)
        stream.send_blueprint(layout(shape_of(run, chosen), active_tab=tab))
        stream.flush()
        _settle(client)
        if chosen and tab == 0:
            client.set_time(CLOCK, duration=at_s, play_state="paused")
        else:
            client.set_time("trial", sequence=trial, play_state="paused")
        Path(path).write_bytes(_settle(client))
        stream.disconnect()


def live_screenshot(
    connect: str, path: Path | str, *, after_s: float, run_dir: Path | None = None
) -> None:
    """Follow a running run in a viewer without a window and write what it shows.

    Args:
        connect: The learner's endpoint.
        path: PNG file to write.
        after_s: How long to follow, or until the run ends [s].
        run_dir: The run's folder, if it is at hand: what it has on record is drawn first.

    Raises:
        LinkError: If no learner is alive at ``connect``.
        RecordError: If there is no graphics driver.
    """
    with _quiet(), _headless() as client:
        stream = rr.RecordingStream(APPLICATION, recording_id="screenshot")
        stream.connect_grpc(client.url)
        until_s = time.monotonic() + after_s
        follow(connect, stream, closed=lambda: time.monotonic() > until_s, run_dir=run_dir)
        stream.flush()
        Path(path).write_bytes(_settle(client))
        stream.disconnect()


def main(arguments: Sequence[str] | None = None) -> int:
    """Take one picture as a program; return its exit code."""
    parser = argparse.ArgumentParser(prog="shearline.record.screenshot")
    parser.add_argument("run", type=Path, help="the run folder")
    parser.add_argument("out", type=Path, help="PNG file to write")
    parser.add_argument("--trial", type=int, default=0, help="trial under the cursor")
    parser.add_argument("--tab", type=int, default=0, help="tab in front, from 0")
    parser.add_argument("--page", action="append", default=[], help="a trial to show in full")
    parser.add_argument("--at", type=float, default=0.0, help="cursor on a page [s]")
    parser.add_argument("--live", metavar="ENDPOINT", help="follow the run that goes on there")
    parser.add_argument("--after", type=float, default=10.0, help="follow it so long [s]")
    asked = parser.parse_args(arguments)
    try:
        if asked.live:
            live_screenshot(asked.live, asked.out, after_s=asked.after, run_dir=asked.run)
            return 0
        screenshot(
            asked.run,
            asked.out,
            trial=asked.trial,
            tab=asked.tab,
            pages=asked.page,
            at_s=asked.at,
        )
    except (LinkError, RecordError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - a program's one sentence
        return 4
    return 0


@contextmanager
def _quiet() -> Iterator[None]:
    """Let the viewer's statistics stay off for as long as the block lasts."""
    before = dict(os.environ)
    with quiet_environment() as environment:
        os.environ.update(environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


@contextmanager
def _headless() -> Iterator[ViewerClient]:
    try:
        client = ViewerClient.spawn(headless=True, port=free_port(), executable_path=executable())
    except Exception as error:
        raise RecordError(
            f"a picture needs a graphics driver, a software one will do: {error}"
        ) from error
    try:
        yield client
    except (RuntimeError, ConnectionError) as error:  # Rerun's, when the viewer has gone
        raise RecordError(
            "the viewer ended before its picture was taken: it needs a graphics driver, a software"
            f" one will do: {error}"
        ) from error
    finally:
        client.quit()


def _settle(client: ViewerClient) -> bytes:
    """Return the picture once it stays the same."""
    until_s = time.monotonic() + PATIENCE_S
    last, looks = b"", 0
    while looks < STILL_LOOKS and time.monotonic() < until_s:
        now: bytes = client.take_screenshot()
        looks = looks + 1 if now == last else 0
        last = now
    return last


if __name__ == "__main__":
    sys.exit(main())
