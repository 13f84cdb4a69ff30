"""Every choice that the paper's section 3 leaves open, as one documented value.

``PSPConfig()`` is the reading that works, ``PSPConfig.paper()`` the one that is written.
docs/learners.md has the figures behind each default.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Self

from shearline.learner.switches import check, having


class MixtureData(enum.StrEnum):
    """Which samples the Gaussian mixture is fitted to."""

    SUCCESSES = "successes"  # all trials that reached the goal: what section 3.2.1 says
    POSITIVES = "positives"  # those labelled positive against the mean reward


class Covariance(enum.StrEnum):
    """Shape of the mixture's components."""

    FULL = "full"  # what "Gaussian mixture" means when nothing else is said
    DIAGONAL = "diagonal"  # n numbers instead of n(n+1)/2: can be fitted to a few samples


class Labels(enum.StrEnum):
    """Which mean reward the samples are labelled against."""

    NEW = "new"  # update the mean, then label: section 3.3 and figure 3
    PREVIOUS = "previous"  # label, then update the mean: algorithm 1


class Distance(enum.StrEnum):
    """What "distance to the decision plane" measures when gamma is chosen."""

    FUNCTIONAL = "functional"  # |f(x)|
    GEOMETRIC = "geometric"  # |f(x)| / |w|, a length in feature space


class RewardMap(enum.StrEnum):
    """How a success's cost becomes a reward (failures are -1)."""

    LINEAR = "linear"  # (C_max - C) / (C_max - C_min): the threshold is an arithmetic mean
    RECIPROCAL = "reciprocal"  # 1 / C, for positive costs: a harmonic mean, stricter


class Outside(enum.StrEnum):
    """What happens to a component's draw that leaves the cube."""

    CLIP = "clip"
    REFLECT = "reflect"
    REDRAW = "redraw"


class Exhausted(enum.StrEnum):
    """What is applied when the filter rejected ``redraws_max`` proposals."""

    LAST = "last"  # the last one: "applied regardless"
    BEST = "best"  # the one with the largest decision value


class Partitioner(enum.StrEnum):
    """What parts good from bad."""

    SVM = "svm"  # a support vector machine with an RBF kernel: the paper's
    FOREST = "forest"  # a random forest
    BOOSTING = "boosting"  # gradient boosted trees
    NETWORK = "network"  # a small neural network: the paper's future work


@dataclass(frozen=True, slots=True)
class PSPConfig:
    """Switches and numbers of PSP.

    Attributes:
        proposal_min: n_p,min: successes from which the mixture replaces the uniform proposal;
            the authors' public code uses 5 for its filter, the paper gives no number.
        filter_min: n_f,min: successes from which the filter is active.
        components_max: n_g: most components the mixture may have; the paper advises 1 to 3.
        redraws_max: n_s: most proposals per trial; 200 bounds an episode to milliseconds and
            reaches what 1000 did.
        mixture_data: Samples the mixture is fitted to.
        covariance: Shape of its components.
        covariance_floor: Least standard deviation of a component along any axis, in units of
            the cube's edge; keeps a component on few samples from collapsing.
        spread: Factor on the components' standard deviations when drawing.
        labels: Mean reward the samples are labelled against.
        reward: Map from cost to reward.
        neighbours: Trials around a success that say how reliable it is: its reward becomes the
            one to be expected if it were repeated, failures counting -1. 0 takes every success
            at its word, as the paper does.
        partition: What the filter is; ``svm_c``, ``gammas`` and ``distance`` are the machine's.
        svm_c: C, the price of a sample on the wrong side. The paper wants it high; low, the filter
            is stricter where good samples are few, and never explodes on contradicting labels.
        balanced: Whether samples are weighted inversely to the size of their class.
        gammas: Kernel widths tried, as multiples of 12 / n: the value at which two uniformly
            random points of the cube have kernel value e**-2.
        distance: Distance whose minimum over the samples chooses gamma.
        outside: What happens to draws outside the cube.
        exhausted: What is applied after ``redraws_max`` rejections.
        fit_samples_max: Latest trials that an update looks at; bounds its time. A run of the
            paper has 200 to 400.
    """

    proposal_min: int = 5
    filter_min: int = 5
    components_max: int = 3
    redraws_max: int = 200
    mixture_data: MixtureData = MixtureData.POSITIVES
    covariance: Covariance = Covariance.DIAGONAL
    covariance_floor: float = 0.01
    spread: float = 1.0
    labels: Labels = Labels.NEW
    reward: RewardMap = RewardMap.LINEAR
    neighbours: int = 12
    partition: Partitioner = Partitioner.SVM
    svm_c: float = 3.0
    balanced: bool = False
    gammas: tuple[float, ...] = (1.0,)
    distance: Distance = Distance.GEOMETRIC
    outside: Outside = Outside.REFLECT
    exhausted: Exhausted = Exhausted.LAST
    fit_samples_max: int = 1000

    def __post_init__(self) -> None:
        _check(self.proposal_min >= 1, "proposal_min", "1 or more", self.proposal_min)
        _check(self.filter_min >= 1, "filter_min", "1 or more", self.filter_min)
        _check(self.components_max >= 1, "components_max", "1 or more", self.components_max)
        _check(self.redraws_max >= 1, "redraws_max", "1 or more", self.redraws_max)
        _check(self.covariance_floor > 0, "covariance_floor", "above 0", self.covariance_floor)
        _check(self.spread > 0, "spread", "above 0", self.spread)
        _check(self.neighbours >= 0, "neighbours", "0 or more", self.neighbours)
        _check(self.svm_c > 0, "svm_c", "above 0", self.svm_c)
        gammas_ok = len(self.gammas) > 0 and all(g > 0 for g in self.gammas)
        _check(gammas_ok, "gammas", "one or more factors above 0", self.gammas)
        _check(self.fit_samples_max >= 10, "fit_samples_max", "10 or more", self.fit_samples_max)

    @classmethod
    def paper(cls) -> Self:
        """Return the literal reading of section 3.

        Where the paper gives no number, the value is ours: C and the grid of gammas as wide
        as proposals can still pass the filter (see docs/learners.md).
        """
        return cls(
            mixture_data=MixtureData.SUCCESSES,
            covariance=Covariance.FULL,
            neighbours=0,
            redraws_max=1000,
            svm_c=1e4,
            gammas=(0.1, 0.18, 0.32, 0.56, 1.0, 1.8, 3.2, 5.6, 10.0),
            distance=Distance.FUNCTIONAL,
            outside=Outside.CLIP,
        )

    def having(self, **switches: object) -> Self:
        """Return a copy with switches changed; words stand for their enum members.

        Raises:
            SwitchError: If there is no such switch or it has no such value.
        """
        return having(self, "psp", switches)


def _check(holds: bool, name: str, expected: str, got: object) -> None:  # noqa: FBT001 - as in an assertion
    check(holds, "psp", name, expected, got)
