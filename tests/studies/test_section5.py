"""The tables of section 5, from experiments whose outcomes are known."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from studies.test_experiment import experiment, outcomes

from shearline.studies import section5, section5_picture, tabular
from shearline.studies.experiment import SPREADS

FOUND = [
    experiment("fsss", "ssss", seed=0, again=outcomes("ssff"), around=[outcomes("sf")] * 4),
    experiment("ffss", "sssf", seed=1, again=outcomes("ffff"), around=[outcomes("ss")] * 4),
    experiment("ffff", "ffff", contender="random", cheapest=[]),
]


def cells(table: section5.Table, name: str) -> dict[str, str]:
    head, rows = table
    return next(dict(zip(head, row, strict=True)) for row in rows if row[0] == name)


def test_table_1_has_the_lucky_cost_and_what_the_tuple_costs_again() -> None:
    row = cells(section5.table1(FOUND), "psp")
    assert row["solved"] == "2 of 2"
    assert row["optimised cost"] == "1.500 ± 0.500"
    assert row["again %"] == "25.0 ± 25.0"
    assert row["recommended %"] == "87.5 ± 12.5"


def test_who_never_succeeded_has_no_cost_and_breaks_nothing() -> None:
    row = cells(section5.table1(FOUND), "random")
    assert (row["solved"], row["optimised cost"], row["again %"]) == ("0 of 1", "-", "-")


def test_table_2_has_success_by_episode_and_the_papers_where_it_is_as_long() -> None:
    row = cells(section5.table2(FOUND), "psp")
    assert (row["1"], row["2"]) == ("25.0", "100.0")
    assert len(section5.table2(FOUND)[1]) == 2
    ten = [experiment("s" * 20, episodes=10)]
    assert cells(section5.table2(ten), "paper: PSP")["10"] == "98.8"


def test_reliability_shows_the_worst_experiment_and_whether_claims_hold() -> None:
    row = cells(section5.reliability(FOUND), "psp")
    assert row["worst %"].startswith("75 [")
    assert row["borne out"] == "2 of 2"
    assert cells(section5.reliability(FOUND), "random")["borne out"] == "0 of 1"


def test_a_rerun_holds_the_cheapest_cost_only_near_it() -> None:
    lucky = experiment("fs", again=outcomes("ffs"))  # success at cost 2, twice the cheapest
    assert section5.held(lucky) == 0.0
    assert section5.held(experiment("ffs", again=outcomes("ffss"))) == 0.5


def test_the_subspace_pools_all_draws_of_a_spread() -> None:
    head, _ = section5.subspace(FOUND)
    assert head[1:] == ["0", *(f"{spread:g}" for spread in SPREADS)]
    row = cells(section5.subspace(FOUND), "psp")
    assert row["0"].startswith("87.5 [")
    assert row["0.03"].startswith("75.0 [")


def test_curves_are_plain_and_the_best_never_rises() -> None:
    psp, random = json.loads(json.dumps(section5.fig6(FOUND)))
    assert psp["mean_cost"] == [0.0, 1.0, 2.0, 3.0]
    assert psp["success"] == [0.25, 1.0]
    assert psp["best_cost"] == [None, 1.0, 1.5, 1.5]
    assert random["best_cost"] == [None] * 4


def test_tables_are_written_for_people_and_as_markdown() -> None:
    head, rows = ["", "a"], [["psp", "1"], ["paper: PSP", "22"]]
    assert tabular.aligned(head, rows) == ["             a", "psp          1", "paper: PSP  22"]
    assert tabular.markdown(head, rows)[2:] == ["| `psp` | 1 |", "| paper: PSP | 22 |"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["draw_fig6", "draw_success", "draw_subspace"])
def test_every_picture_can_be_drawn(name: str, tmp_path: Path) -> None:
    getattr(section5_picture, name)(FOUND, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 2000
