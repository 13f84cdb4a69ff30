"""What a fit loads, and how many threads it uses."""

from __future__ import annotations

import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

from shearline.learner.psp.model import LIBRARIES
from shearline.learner.threads import fitting

TRIALS = """
import sys
import numpy as np
from shearline.learner import Space, create
learner = create(sys.argv[1], Space({n: ("m", 0.0, 1.0) for n in "xyz"}), episode_length=20)
for _ in range(3):
    for p in learner.ask(20):
        learner.tell(p.trial, cost=float(np.sum(p.theta**2)), success=bool(p.theta[0] < 0.9))
learner.recommend()
print("sklearn" in sys.modules)
"""


def test_a_fit_uses_one_thread_of_every_library_that_it_loads() -> None:
    with fitting(*LIBRARIES):
        used = threadpool_info()
    assert len(used) > 1, "numpy's and scikit-learn's"
    assert {library["num_threads"] for library in used} == {1}


@pytest.mark.parametrize("name", ["psp-ranked", "cmaes", "hireps", "lhs"])
def test_who_does_without_scikit_learn_does_not_wait_a_second_for_it(name: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", TRIALS, name], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
