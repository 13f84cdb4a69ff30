import json

import numpy as np
import pytest

from shearline.deploy.studies.fig3 import PROBLEMS, REWARD_MAX, Peaks, find
from shearline.studies.peaks import EPISODES, grid


@pytest.mark.parametrize("peaks", PROBLEMS, ids=lambda peaks: peaks.problem.name)
def test_the_maxima_that_are_drawn_are_the_problems(peaks: Peaks) -> None:
    points = grid()
    cost = peaks.problem.cost(points)
    reward = REWARD_MAX - cost
    assert cost.min() >= 0.0
    at = np.array(peaks.maxima)
    highest = REWARD_MAX - peaks.problem.cost(at)
    assert reward.max() <= highest.max() + 1e-4
    near = np.linalg.norm(points[:, None] - at[None], axis=-1).min(axis=1)
    assert near[np.argmax(reward)] < 0.01


def test_the_figures_data_are_plain_and_complete() -> None:
    found = find(PROBLEMS[0], "psp", range(3, 5))
    data = json.loads(json.dumps(found.data()))
    assert data["runs"] == len(data["best_reward"]) == 2
    assert data["kept"] == data["kept_any"] == 2
    assert len(data["panels"]) == EPISODES
    assert data["panels"][-1]["holds"] == [True]
    assert data["panels"][-1]["best_reward"] == data["best_reward"][0]
