"""Intervals for a success probability, from counts of trials and nothing else."""

from __future__ import annotations

import math
from statistics import NormalDist

#: Confidence of everything that is stated.
CONFIDENCE = 0.95


def clopper_pearson_low(successes: int, trials: int, confidence: float = CONFIDENCE) -> float:
    """Return the exact one-sided lower bound of a success probability.

    The bound of Clopper and Pearson (1934), Biometrika 26:404-413: the probability under which
    ``successes`` or more would be seen with chance ``1 - confidence``.

    Args:
        successes: Successes seen, 0 to ``trials``.
        trials: Trials made, 0 or more.
        confidence: Between 0 and 1.
    """
    if successes == 0:
        return 0.0
    from scipy.special import betaincinv  # noqa: PLC0415 - only who recommends pays for scipy

    return float(betaincinv(successes, trials - successes + 1, 1.0 - confidence))


def wilson(successes: int, trials: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the two-sided interval of a success probability after Wilson.

    Wilson (1927), J. Am. Stat. Assoc. 22:209-212: the probabilities ``p`` for which the share
    seen is within ``z`` standard errors ``sqrt(p (1 - p) / trials)`` of ``p``.

    Args:
        successes: Successes seen, 0 to ``trials``.
        trials: Trials made, 0 or more; without any, nothing is known.
        confidence: Between 0 and 1.

    Returns:
        ``(low, high)``, within 0 to 1.
    """
    if trials == 0:
        return 0.0, 1.0
    square = NormalDist().inv_cdf(0.5 + confidence / 2) ** 2
    share = successes / trials
    middle = share + square / (2 * trials)
    half = math.sqrt(square * (share * (1 - share) / trials + square / (4 * trials**2)))
    scale = 1 + square / trials
    low = 0.0 if successes == 0 else (middle - half) / scale
    high = 1.0 if successes == trials else (middle + half) / scale
    return low, high
