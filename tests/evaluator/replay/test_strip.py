"""What is written on a film says what happened, and changes with time only where it should."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.replay import Case, Change, Replayed, again
from shearline.evaluator.replay.strip import HEIGHT, PAPER, Strip, caption, said

WIDTH = 1280


@pytest.fixture(scope="module")
def replayed(keylock: KeylockTask, recorded: Case) -> Replayed:
    again_ = again(keylock, recorded)
    return replace(again_, verdict=structs.replace(again_.verdict, trace=recorded.traces[0]))


def test_a_caption_says_which_trial_how_it_ended_and_how_fast_it_goes(replayed: Replayed) -> None:
    head, rest = said(replayed, 0.25)
    assert head == f"trial 7: success, cost {replayed.verdict.cost:.3g}"
    assert rest == "keylock, at 0.25 of real time"
    assert said(replayed, 1.0)[1] == "keylock, in real time"


def test_a_caption_says_what_was_changed(keylock: KeylockTask, recorded: Case) -> None:
    change = Change({"ins_push": 0.0}, seed=5)
    head, rest = said(again(keylock, recorded, change), 1.0)
    assert head.startswith("trial 7: failure (")
    assert rest.endswith("ins_push 0 N instead of 19, seed 5")
    many = Change({"ins_push": 0.0, "xi": 0.5, "wig_a_x": 1.0}, seed=5)
    assert said(again(keylock, recorded, many), 1.0)[1].endswith("2 more changes")


def test_a_strip_moves_with_time(replayed: Replayed) -> None:
    trace = replayed.verdict.trace
    assert trace is not None
    strip = Strip(trace, WIDTH)
    first, again_, last = strip.at(0), strip.at(0), strip.at(trace.t_s.size - 1)
    assert first.shape == (HEIGHT, WIDTH, 3)
    np.testing.assert_array_equal(first, again_)
    # Numbers and the line that says now are new, the paper around them is not.
    changed = np.any(first != last, axis=2)
    assert 0.005 < changed.mean() < 0.2
    assert changed[:, :220].any()
    assert tuple(first[2, 2]) == PAPER


def test_a_caption_is_written_on_paper(replayed: Replayed) -> None:
    picture = caption(replayed, 1.0, WIDTH)
    dark = np.all(picture < 128, axis=2)
    assert 0.005 < dark.mean() < 0.2
    assert tuple(picture[0, 0]) == PAPER
