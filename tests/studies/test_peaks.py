from __future__ import annotations

import numpy as np
import pytest

from shearline.learner import Space, create
from shearline.protocol.errors import ConfigError
from shearline.sims.functions import Array, Problem, two_peaks, two_peaks_narrow
from shearline.studies.peaks import EPISODE_LENGTH, EPISODES, GRID, Panel, grid, watch


def cost(u: Array) -> Array:
    return 2.0 - two_peaks_narrow(u)


PROBLEM = Problem("narrow", Space.unit(2), cost)
SWITCHES = {"svm_c": 1e3}


@pytest.fixture(scope="module")
def panels() -> list[Panel]:
    return watch(PROBLEM, 2, "psp", SWITCHES)


def test_there_is_a_panel_for_each_episode_with_the_samples_until_then(
    panels: list[Panel],
) -> None:
    assert [len(panel.u) for panel in panels] == [EPISODE_LENGTH * (k + 1) for k in range(EPISODES)]
    assert all(panel.fresh.sum() == EPISODE_LENGTH for panel in panels)
    np.testing.assert_array_equal(panels[-1].u[: len(panels[0].u)], panels[0].u)


def test_the_accepted_region_shrinks_onto_both_peaks(panels: list[Panel]) -> None:
    shares = [panel.accepted for panel in panels]
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.1
    assert panels[-1].regions == 2
    assert panels[-1].holds((0.25, 0.25))
    assert panels[-1].holds((0.75, 0.75))
    assert not panels[-1].holds((0.5, 0.5))


def test_the_region_drawn_is_the_one_that_the_learner_proposes_from(panels: list[Panel]) -> None:
    learner = create("psp", Space.unit(2), EPISODE_LENGTH, 2, **SWITCHES)
    for panel in panels:
        proposals = learner.ask(EPISODE_LENGTH)
        np.testing.assert_array_equal([p.theta for p in proposals], panel.u[panel.fresh])
        if panel.episode:
            before = panels[panel.episode - 1]
            x, y = np.rint(panel.u[panel.fresh] * (GRID - 1)).astype(int).T
            # All but those few that were applied regardless, or lie within half a cell of it.
            assert np.mean(before.decision[y, x] >= 0.0) >= 0.9
        for p in proposals:
            learner.tell(p.trial, cost=float(cost(p.theta)), success=True)


def test_the_problem_as_printed_has_one_region_around_its_one_maximum() -> None:
    printed = Problem("as printed", Space.unit(2), lambda u: 2.0 - two_peaks(u))
    last = watch(printed, 0, "psp", SWITCHES)[-1]
    assert last.regions == 1
    assert last.holds((0.5, 0.5))
    assert 2.0 - last.best_cost == pytest.approx(1.765, abs=0.005)


def test_the_grid_has_its_rows_along_the_second_parameter() -> None:
    points = grid().reshape(GRID, GRID, 2)
    np.testing.assert_array_equal(points[:, 0, 0], 0.0)
    np.testing.assert_array_equal(points[0, :, 1], 0.0)
    np.testing.assert_allclose(points[-1, -1], [1.0, 1.0])


def test_a_learner_without_labels_is_refused() -> None:
    with pytest.raises(ConfigError, match="psp"):
        watch(PROBLEM, 0, "lhs", {})
