from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shearline.learner.lhs import latin_hypercube


@given(samples=st.integers(1, 60), n=st.integers(1, 30), seed=st.integers(0, 2**32))
def test_each_stratum_of_each_parameter_holds_one_sample(samples: int, n: int, seed: int) -> None:
    design = latin_hypercube(np.random.default_rng(seed), samples, n)
    assert design.shape == (samples, n)
    strata = np.sort(np.floor(design * samples).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(samples)[:, None], (1, n)))
