"""Each picture shows what the record says, and says what it cannot show."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shearline.protocol.messages import OutcomeKind, Snapshot
from shearline.record.report import (
    cost,
    durations,
    evaluators,
    failures,
    headline,
    health,
    listing,
    parameters,
    recommendation,
    reproduce,
    slices,
    success,
)
from shearline.record.report.facts import Facts, gather

See = Callable[..., Any]
Write = Callable[..., Path]
Make = Callable[..., Any]
PICTURES = (success, cost, recommendation, parameters, failures, durations, evaluators, health)


@pytest.mark.parametrize("picture", PICTURES, ids=lambda module: module.__name__.split(".")[-1])
def test_a_run_without_a_trial_has_words_for_every_picture(
    picture: Any, tmp_path: Path, see: See
) -> None:
    page = see(picture.picture(gather(tmp_path)))
    assert page.count("card") == 1
    assert page.text.count(".") >= 1
    assert not any(element == "svg" for element, _ in page.elements)


def test_success_has_a_dot_for_each_episode_with_its_numbers(facts: Facts, see: See) -> None:
    page = see(success.picture(facts))
    assert page.count("ok") == 3
    for i, won in enumerate(facts.episodes.successes):
        assert f"episode {i + 1}: {won} of 8 succeeded" in page.text


def test_every_trial_is_in_the_picture_of_costs_once(facts: Facts, see: See) -> None:
    page = see(cost.picture(facts))
    for number, outcome in zip(facts.table["trial"], facts.table["outcome"], strict=True):
        assert page.text.count(f"trial {number}: cost") == (outcome != "lost")
    dots = [attributes for _, attributes in page.elements if "d" in attributes]
    fresh = [a for a in dots if "fresh" in (a["class"] or "")]
    assert len(fresh) == 2
    (lost,) = (a for a in dots if a["class"] == "lost")
    assert str(lost["d"]).count("V") == 1


def test_best_so_far_never_rises_and_knows_no_failure() -> None:
    costs = np.array([3.0, 1.0, 5.0, 0.5, 2.0])
    won = np.array([False, False, True, False, True])
    best = cost.best_so_far(costs, won)
    assert np.isnan(best[:2]).all()
    assert best[2:].tolist() == [5.0, 5.0, 2.0]


def test_parallel_coordinates_have_a_line_for_each_trial_and_a_row_for_each_parameter(
    facts: Facts, see: See
) -> None:
    page = see(parameters.picture(facts))
    assert page.count("strand") == 24
    assert page.text.count("0 to 20") == 1
    for name in facts.names:
        assert name in page.text
    lines = [a["d"] for _, a in page.elements if "strand" in (a.get("class") or "").split()]
    assert all(str(line).count("L") == 4 for line in lines)


def test_of_too_many_lines_some_are_drawn_evenly_with_both_ends() -> None:
    kept = parameters.thinned(np.arange(2000), 400)
    assert len(kept) == len(set(kept)) == 400
    assert (kept[0], kept[-1]) == (0, 1999)
    assert max(np.diff(kept)) <= 6
    assert parameters.thinned(np.arange(7), 400) == list(range(7))


def test_the_recommendation_says_value_range_region_and_chance(facts: Facts, see: See) -> None:
    page = see(recommendation.picture(facts))
    text = page.text.replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "probability 0.93 (95 % interval 85 to 100 %), cost about 0.41" in text
    assert "100 N m/rad" in text
    assert "± 113" in text
    assert "tried 2 times on fresh noise, on robots: 1 succeeded (95 % interval 9 to 91 %)" in text
    assert "the claim of at least 85 % is borne out. Failed: trial 25." in text
    ends = [a["style"] for _, a in page.elements if a.get("class") == "region"]
    assert "left:0%;width:100%" in ends, "a spread beyond the bounds ends at them"


def test_a_claim_that_fresh_trials_do_not_bear_out_is_said_in_red(whole: Path, see: See) -> None:
    facts = gather(whole)
    facts.summary["confirmation"]["bears_out"] = False
    page = see(recommendation.picture(facts))
    assert "is not borne out" in page.text
    assert page.count("trouble") == 1


@pytest.mark.parametrize(
    ("share", "reach", "dot", "band"),
    [(0.5, 0.1, "left:50%", "left:40%;width:20%"), (1.2, 0.3, "left:100%", "left:70%;width:30%")],
)
def test_a_gauge_stays_within_its_range(
    share: float, reach: float, dot: str, band: str, see: See
) -> None:
    styles = [a.get("style") for _, a in see(recommendation.in_range(share, reach)).elements]
    assert styles == [None, band, dot]


def test_slices_show_the_partition_and_all_samples(facts: Facts, see: See) -> None:
    page = see(slices.picture(facts, None))
    assert page.count("square") == 6
    assert page.count("good-edge") == 6
    assert page.count("drawn") == 6 + 1, "one in each slice and one in the legend"
    samples = sum(
        str(a["d"]).count("h0")
        for _, a in page.elements
        if {"ok", "bad"} & set((a.get("class") or "").split()) and "d" in a
    )
    assert samples == 6 * 24
    assert "The partition that episode 4 was drawn with" in page.text


def test_slices_go_back_to_the_last_partition_that_takes_anything_for_good(
    whole: Path, write_messages: Write
) -> None:
    refusing = '{"episode": 4, "partition": {"kind": "svm-rbf", "support": [[0, 0, 0, 0, 0]],'
    refusing += ' "dual": [1.0], "gamma": 9.0, "intercept": -2.0}}'
    write_messages(Snapshot(episode=4, learner="psp", model=refusing, at_s=9.0))
    model, decision = slices.newest(gather(whole))
    assert decision is not None
    assert model["episode"] == 3


def test_a_partition_of_another_kind_leaves_the_samples_alone(write_run: Write, see: See) -> None:
    page = see(slices.picture(gather(write_run()), None))
    assert page.count("good") == 0
    assert page.count("ok") > 0
    assert "keeps no partition" in page.text


def test_failures_are_counted_by_kind_with_the_latest_to_look_at(facts: Facts, see: See) -> None:
    found = {kind.why: kind.members for kind in failures.kinds(facts)}
    assert list(found)[-1] == "lost"
    assert len(found["time"]) == facts.failure.sum()
    page = see(failures.picture(facts))
    latest = facts.table["trial"][found["time"][-1]]
    assert f"trial {latest}" in page.text
    assert f"shearline view {facts.path} --trial {latest}." in page.text
    assert "trial 26" in page.text


def test_many_kinds_of_failure_share_the_last_colour(
    write_messages: Write, outcome: Make, see: See
) -> None:
    failed = [outcome(i, OutcomeKind.FAILURE, why=f"kind {i}") for i in range(8)]
    page = see(failures.picture(gather(write_messages(*failed))))
    assert "others" in page.text
    assert page.text.count("kind 7") == 1


def test_phases_stand_on_each_other_and_name_themselves(facts: Facts, see: See) -> None:
    page = see(durations.picture(facts))
    assert "contact" in page.text
    assert "insertion" in page.text
    bars = [str(a["d"]) for _, a in page.elements if "bar" in (a.get("class") or "").split()]
    assert [bar.count("Z") for bar in bars] == [24, 24]


def test_without_traces_the_wall_clock_stands_in(
    write_messages: Write, outcome: Make, see: See
) -> None:
    trials = [outcome(i, OutcomeKind.SUCCESS) for i in range(3)]
    page = see(durations.picture(gather(write_messages(*trials))))
    assert "no trace" in page.text


def test_lanes_cover_the_run_without_a_gap_until_an_evaluator_leaves(
    state: Make, begin_s: float
) -> None:
    states = [
        state("b", "busy", 0.0),
        state("a", "idle", 1.0),
        state("b", "gone", 4.0, lost=2),
        state("a", "busy", 5.0, done=3),
        state("a", "left", 8.0, done=5),
    ]
    a, b = evaluators.lanes(states, begin_s, begin_s + 10.0)
    assert [(s.look, s.start_s, s.end_s) for s in a.stretches] == [
        ("idle", 1.0, 5.0),
        ("busy", 5.0, 8.0),
    ]
    assert [(s.look, s.end_s) for s in b.stretches] == [("busy", 4.0), ("missing", 10.0)]
    assert (a.busy_s(), b.busy_s()) == (3.0, 4.0)
    assert (a.done, b.lost) == (5, 2)


def test_of_a_crowd_the_busiest_lanes_are_shown(
    write_messages: Write, state: Make, see: See
) -> None:
    states = [state(f"sim-{i:03d}", "busy" if i >= 30 else "idle", 0.0) for i in range(60)]
    ends = [state(f"sim-{i:03d}", "left", 1.0) for i in range(60)]
    page = see(evaluators.picture(gather(write_messages(*states, *ends))))
    assert page.count("lane") == evaluators.LANES_MAX
    assert "60 evaluators" in page.text
    assert all(f"sim-{i:03d}" in page.text for i in range(30, 60))


def test_health_counts_and_gives_the_reasons_of_what_was_aborted(facts: Facts, see: See) -> None:
    (abort,) = health.aborts(facts.run)
    assert abort.trials == (5, 7), "a result said twice is one attempt"
    page = see(health.picture(facts))
    assert "2 attempts aborted: the engine <stopped> (last of trial 7)" in page.text
    assert page.count("trouble") == 2


def test_damage_is_said_before_anything_else_about_health(whole: Path, see: See) -> None:
    facts = gather(whole)
    facts.damage.append("record.mcap: it breaks off at byte 7")
    page = see(health.picture(facts))
    assert page.text.index("breaks off at byte 7") < page.text.index("counted")


def test_commands_name_the_run_and_can_be_typed_as_they_stand(facts: Facts, see: See) -> None:
    typed = dict(reproduce.commands(facts))
    assert typed["the same run"].startswith(f"shearline up {facts.path}/run.toml --evaluators 2")
    best = facts.table["trial"][facts.success][facts.table["cost"][facts.success].argmin()]
    replay = f"shearline replay {facts.path} --trial {best} --verify"
    assert typed["its cheapest success, to the last bit"] == replay
    page = see(reproduce.picture(facts))
    assert "mujoco 4.0.0 model 3f2a (24 trials)" in page.text
    assert "[task.space]" in page.text


def test_the_list_has_a_row_for_each_trial(facts: Facts, see: See) -> None:
    page = see(listing.listing(facts))
    assert sum(element == "tr" for element, _ in page.elements) == 28
    assert "Every trial (27)" in page.text


def test_the_headline_tells_the_fresh_trials_of_the_recommended_tuple(
    facts: Facts, see: See
) -> None:
    page = see(headline.headline(facts))
    assert page.count("tile") == 5
    assert "recommended, tried again" in page.text
    assert "1 of 2" in page.text
    assert "1 lost" in page.text
