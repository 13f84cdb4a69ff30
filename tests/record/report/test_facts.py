"""What a report knows of a run, whatever state its folder is in."""

import json
from pathlib import Path

import numpy as np
import pytest

from shearline.learner.region import Region
from shearline.protocol.errors import RecordError
from shearline.protocol.space import Space
from shearline.record.report.facts import Facts, gather


def test_only_what_the_learner_asked_for_counts_as_learning(facts: Facts) -> None:
    assert facts.learning.sum() == 25
    assert len(facts.table["trial"]) == 27
    assert facts.success.sum() + facts.failure.sum() == 24
    assert facts.lost.sum() == 1
    assert not np.any((facts.success | facts.failure | facts.lost) & ~facts.learning)


def test_episodes_are_counted_from_the_outcomes_themselves(facts: Facts) -> None:
    episodes = facts.episodes
    assert episodes.number.tolist() == [0, 1, 2]
    assert episodes.trials.tolist() == [8, 8, 8]
    assert episodes.successes.sum() == facts.success.sum()
    said = [closed.successes for closed in facts.run.episodes]
    assert episodes.successes.tolist() == said


def test_the_advice_has_its_interval_its_region_and_its_claim(facts: Facts) -> None:
    advice = facts.advice
    assert advice is not None
    assert advice.theta.tolist() == [12.0, 0.05, 5.0, 1.5, 100.0]
    assert (advice.probability, advice.interval, advice.cost) == (0.93, (0.85, 1.0), 0.41)
    assert advice.spread is not None
    half_axes = np.array([3.0, 0.01, 1.0, 0.5, 300.0])
    np.testing.assert_allclose(advice.spread, half_axes / np.sqrt(5 + 2))
    assert "at least 81 %" in advice.claim
    assert "37 of 40 trials" in advice.claim


def test_the_spread_is_that_of_draws_from_the_region() -> None:
    n, radius = 23, 0.05
    space = Space.box(n, -1.0, 1.0)
    region = Region(space, np.zeros(n), np.full(n, radius), 0.9, 0.95, 40, 40)
    drawn = region.sample(np.random.default_rng(0), 20_000).std(axis=0)
    np.testing.assert_allclose(drawn, radius / np.sqrt(n + 2), rtol=0.05)


def test_a_confirmation_is_told_apart_by_what_was_tried(facts: Facts) -> None:
    (tried,) = facts.confirmations
    assert (tried.what, tried.successes, tried.trials, tried.bears_out) == ("tuple", 1, 2, True)


def test_tuples_are_shares_of_the_bounds(facts: Facts) -> None:
    low, high = facts.bounds
    np.testing.assert_allclose(facts.unit_of(low), 0.0)
    np.testing.assert_allclose(facts.unit_of(high), 1.0)
    assert facts.units == ["N", "m/s", "N", "Hz", "N m/rad"]
    np.testing.assert_allclose(low + facts.u * (high - low), facts.table.theta)


def test_an_interrupted_run_has_no_advice_but_everything_else(whole: Path) -> None:
    (whole / "summary.json").unlink()
    facts = gather(whole)
    assert facts.advice is None
    assert facts.confirmations == []
    assert facts.success.any()
    assert facts.damage == []


@pytest.mark.parametrize("text", ["{", "[]3", "3"])
def test_a_summary_that_is_no_json_is_one_sentence(whole: Path, text: str) -> None:
    (whole / "summary.json").write_text(text, encoding="utf-8")
    facts = gather(whole)
    (sentence,) = facts.damage
    assert sentence.startswith("summary.json: it is not JSON")
    assert facts.advice is None


def test_where_no_bounds_are_known_those_of_what_was_tried_stand_in(whole: Path) -> None:
    facts = gather(whole)
    facts.run.config = None
    low, high = facts.bounds
    np.testing.assert_allclose(low, facts.table.theta.min(axis=0))
    assert np.all(high > low)
    assert (facts.name, facts.task, facts.settings) == (whole.name, "?", {})


def test_models_come_newest_first(facts: Facts) -> None:
    snapshots = [json.loads(snapshot.model) for snapshot in facts.run.snapshots]
    assert list(facts.models()) == snapshots[::-1]


def test_an_empty_folder_is_a_run_without_anything(tmp_path: Path) -> None:
    facts = gather(tmp_path)
    assert facts.name == tmp_path.name
    assert len(facts.episodes.number) == 0
    assert (facts.begin_s, facts.end_s) == (0.0, 0.0)


def test_a_folder_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="expected a run folder"):
        gather(tmp_path / "nowhere")
