"""Seeds: one for each trial, from the run's seed and the trial's number and nothing else."""

from __future__ import annotations

import numpy as np

#: Trial seeds are below this: they fit the signed 64-bit integer of any language.
SEED_END = 2**63


def trial_seed(run_seed: int, trial: int) -> int:
    """Return the seed of one trial, 0 to 2**63 - 1.

    Neighbouring trials and runs get unrelated streams (numpy's ``SeedSequence`` hashes both).

    Args:
        run_seed: 0 or more.
        trial: Number of the trial, from 0.
    """
    word = np.random.SeedSequence([run_seed, trial]).generate_state(1, np.uint64)[0]
    return int(word) % SEED_END
