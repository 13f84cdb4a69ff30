"""The charts of a view show what was learnt from, and nothing that was done for other reasons."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
import rerun as rr

from shearline.protocol.messages import Counted, EpisodeClosed, Message, Purpose
from shearline.record.picture import Picture
from shearline.record.view import APPLICATION
from shearline.record.viewer import executable

CHARTED = ("/success_rate", "/parameters/x0/success", "/parameters/x0/failure")


@pytest.mark.parametrize("purpose", Purpose)
def test_only_what_was_learnt_from_is_on_the_charts(
    purpose: Purpose, messages: Callable[..., list[Message]], tmp_path: Path
) -> None:
    path = tmp_path / "drawn.rrd"
    stream = rr.RecordingStream(APPLICATION, recording_id="charts")
    stream.save(path)
    picture = Picture(stream, None)
    for message in messages():
        if isinstance(message, Counted):
            picture.outcome(msgspec.structs.replace(message, purpose=purpose))
        elif isinstance(message, EpisodeClosed):
            picture.episode(msgspec.structs.replace(message, purpose=purpose))
    picture.flush()
    stream.disconnect()
    listed = subprocess.run(
        [executable(), "rrd", "print", path], capture_output=True, text=True, check=True
    ).stdout
    assert "/card" in listed
    for entity in CHARTED:
        assert (entity in listed) == (purpose is Purpose.LEARNING), entity
