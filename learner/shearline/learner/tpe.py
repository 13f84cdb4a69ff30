"""TPE, the tree-structured Parzen estimator, through the ``optuna`` package; for comparison only.

Akiba et al.'s package (MIT licence) does the search (Bergstra et al. 2011); this translates: trials
that come back late or never, failures into costs. It knows nothing of how the package estimates.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from shearline.learner.base import Array
from shearline.learner.charge import charged
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.errors import LearnerError
from shearline.learner.ledger import Trials


class TPE(EpisodicLearner):
    """The package's ask and tell behind ours, with its own defaults.

    Every episode begins with a new study that is told all outcomes so far, in the order of trials:
    what a failure is charged changes with what succeeded. Trials asked for and not told yet are
    running ones, which the package keeps away from.

    Raises:
        LearnerError: If the ``optuna`` package is not installed.
    """

    name = "tpe"
    primes = True

    _study: Any = None
    _axes: Mapping[str, Any] = MappingProxyType({})

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        del episode
        optuna = _optuna()
        self._axes = {
            f"u{i}": optuna.distributions.FloatDistribution(0.0, 1.0)
            for i in range(len(self.space))
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what it calls experimental
            sampler = optuna.samplers.TPESampler(seed=int(rng.integers(2**32)))
            self._study = optuna.create_study(sampler=sampler)
            self._study.add_trials(
                [
                    optuna.trial.create_trial(
                        params=dict(zip(self._axes, u.tolist(), strict=True)),
                        distributions=self._axes,
                        value=float(cost),
                    )
                    for u, cost in zip(trials.u, charged(trials), strict=True)
                ]
            )

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del index, rng
        asked: Mapping[str, float] = self._study.ask(self._axes).params
        return np.array([asked[name] for name in self._axes])


def _optuna() -> Any:
    """Return the package, told to be quiet."""
    try:
        import optuna  # noqa: PLC0415 - heavy, at the first ask
    except ImportError:
        raise LearnerError(
            "tpe needs the package optuna: install shearline with the extra 'tpe'"
        ) from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna
