"""The end of a run in words says what was recommended, and what fresh trials made of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from shearline.deploy.summary import print_summary

CONFIRMED = {
    "claimed": 0.9, "trials": 40, "successes": 38, "success_rate": 0.95,
    "interval": [0.83, 0.99], "lost": 0, "mean_cost": 0.51, "bears_out": True,
    "kinds": {},
}  # fmt: skip
REGION = {
    "centre": {"push": 12.0}, "radius": {"push": 1.7320508}, "success_low": 0.87,
    "confidence": 0.95, "trials": 55, "successes": 54,
}  # fmt: skip


def printed(capsys: pytest.CaptureFixture[str], **changes: object) -> str:
    advice = {
        "theta": {"push": 12.0}, "success_probability": 0.97, "interval": [0.9, 1.0],
        "cost": 0.5, "region": REGION,
    }  # fmt: skip
    summary = {
        "task": "keylock", "learner": "psp", "seed": 0, "episodes": [], "counted": 40, "lost": 0,
        "duplicates": 0, "late": 0, "aborted": 0, "rejected": 0, "wall_s": 60.0,
        "state": "complete", "why": "", "recommendation": advice, "confirmation": None,
        "region_confirmation": None,
    }  # fmt: skip
    print_summary(summary | changes, Path("run"), {"push": "N"})
    return capsys.readouterr().out


def test_a_recommendation_is_said_with_its_interval_and_how_far_it_may_vary(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = printed(capsys)
    assert "succeeds with probability 0.97 (0.90 to 1.00 at 95 %), cost about 0.500" in text
    assert "draws succeed with at least 0.87" in text
    assert "push 12 ± 1 N" in text
    assert "confirmed" not in text


def test_what_fresh_trials_came_to_stands_beside_what_was_claimed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = printed(capsys, confirmation=CONFIRMED)
    assert "the recommended tuple succeeded in 38 of 40 fresh trials: 0.83 to 0.99 at 95 %" in text
    assert "which bears out the claim of at least 0.90; mean cost 0.510" in text


@pytest.mark.parametrize(
    ("kinds", "words"),
    [
        ({"robot": 40}, "in 38 of 40 fresh trials on robots: 0.83"),
        ({"simulator": 28, "robot": 12}, "fresh trials (12 on robots, 28 on simulators): 0.83"),
    ],
)
def test_who_confirmed_is_said(
    capsys: pytest.CaptureFixture[str], kinds: dict[str, int], words: str
) -> None:
    assert words in printed(capsys, confirmation=CONFIRMED | {"kinds": kinds})


def test_a_claim_that_is_contradicted_is_not_glossed_over(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = printed(capsys, region_confirmation=CONFIRMED | {"bears_out": False, "lost": 2})
    assert "tuples drawn from the region succeeded in 38 of 40 fresh trials, 2 lost" in text
    assert "does NOT bear out" in text


def test_without_a_region_no_width_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    advice = {
        "theta": {"push": 12.0}, "success_probability": 0.5, "interval": [0.0, 1.0],
        "cost": None, "region": None,
    }  # fmt: skip
    text = printed(capsys, recommendation=advice)
    assert "push 12 N" in text
    assert "±" not in text
    assert "cost about -" in text
