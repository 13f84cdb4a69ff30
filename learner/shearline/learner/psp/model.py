"""What PSP believes during one episode, and how it is renewed from the trials told so far.

A model is a value: renewing it makes another one and draws nothing, so that asking for a
recommendation can look ahead without changing what the learner does next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.ledger import Trials
from shearline.learner.psp.config import MixtureData, PSPConfig
from shearline.learner.psp.partition import Partition, fit_partition
from shearline.learner.psp.proposal import Mixture, fit_mixture
from shearline.learner.psp.reward import UNBOUNDED, expected, update
from shearline.learner.threads import fitting

#: What a fit needs.
LIBRARIES = ("sklearn.mixture", "sklearn.svm")


@dataclass(frozen=True, slots=True)
class Model:
    """One episode's beliefs.

    Attributes:
        trials: What they rest on, m trials, with the cost each sample is judged by.
        good: Labels ``(m,)``.
        threshold_cost: Cost of the mean reward of the good samples; ``inf`` at the start.
        components: Size of the mixture once it has been chosen.
        mixture: The proposal policy; ``None`` stands for uniform.
        partition: The filter; ``None`` while it is not active.
    """

    trials: Trials
    good: npt.NDArray[np.bool_]
    threshold_cost: float = UNBOUNDED
    components: int | None = None
    mixture: Mixture | None = None
    partition: Partition | None = None


def renew(model: Model, trials: Trials, seed: int, config: PSPConfig) -> Model:
    """Return the next episode's model.

    Args:
        model: The present one.
        trials: Everything told so far; the latest ``config.fit_samples_max`` are used.
        seed: For what the mixture and the filter draw while they are fitted.
        config: The reading of the paper.
    """
    kept = window(trials, config.fit_samples_max)
    scale = np.ones(kept.u.shape[1]) if model.mixture is None else model.mixture.spread
    judged = expected(kept, scale, config.neighbours)
    good, threshold_cost = update(judged, model.threshold_cost, config.labels, config.reward)
    wins = int(judged.success.sum())
    mixture, components, partition = model.mixture, model.components, model.partition
    if wins >= min(config.proposal_min, config.filter_min):
        with fitting(*LIBRARIES):
            if wins >= config.proposal_min:
                samples = mixture_samples(judged, good, config)
                mixture, components = fit_mixture(samples, components, seed, config)
            if wins >= config.filter_min:
                partition = fit_partition(judged.u, good, config, seed)
    return Model(judged, good, threshold_cost, components, mixture, partition)


def window(trials: Trials, samples_max: int) -> Trials:
    """Return the latest trials, at most ``samples_max``, at least half of them successes.

    Where there are fewer successes or failures than that, the other kind fills up.
    """
    if len(trials) <= samples_max:
        return trials
    won, lost = np.flatnonzero(trials.success), np.flatnonzero(~trials.success)
    won = won[-max(samples_max // 2, samples_max - len(lost)) :]
    lost = lost[len(lost) - min(len(lost), samples_max - len(won)) :]
    keep = np.zeros(len(trials), dtype=np.bool_)
    keep[won] = keep[lost] = True
    return trials.where(keep)


def mixture_samples(trials: Trials, good: npt.NDArray[np.bool_], config: PSPConfig) -> Array:
    """Return the samples ``(k, n)`` the mixture is fitted to.

    With ``positives``, the cheapest successes fill up to ``proposal_min`` where fewer are
    positive: a component needs something to be wide on.
    """
    won = trials.where(trials.success)
    if config.mixture_data is MixtureData.SUCCESSES:
        return won.u
    # Good samples are the cheapest successes by definition; ties go to the earlier trial.
    count = max(int(good.sum()), config.proposal_min)
    return won.u[np.argsort(won.cost, kind="stable")[:count]]
