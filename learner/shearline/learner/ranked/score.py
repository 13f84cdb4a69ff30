"""Reliability and cost as one number: what one success will have cost in the end.

A tuple of cost c that succeeds with chance p fails ``(1 - p) / p`` times for each success; with
failures at the price F a success costs ``c + F (1 - p) / p``.
"""

from __future__ import annotations

import numpy as np

from shearline.learner.base import Array
from shearline.learner.ledger import Trials

#: Below this chance a tuple is bad, and it does not matter how bad.
CHANCE_MIN = 0.05
#: A failure costs at least so many times the spread of the costs of successes, whatever the task
#: charges for it: its cost "is kept but means little".
PRICE_SPREADS = 10.0


def failure_price(seen: Trials, won: Trials) -> float:
    """Return F: what a failed trial costs more than the cheapest success.

    Args:
        seen: Trials of both kinds.
        won: Successes, at least one.
    """
    lost = seen.cost[~seen.success]
    spread = float(np.quantile(won.cost, 0.9) - np.quantile(won.cost, 0.1))
    charged = float(lost.mean() - won.cost.min()) if len(lost) else 0.0
    return max(charged, PRICE_SPREADS * spread)


def score(cost: Array, probability: Array, price: float) -> Array:
    """Return the expected cost ``(m,)`` of one success; less is better.

    Args:
        cost: Of a success ``(m,)``.
        probability: Chance of success ``(m,)``.
        price: Of a failure.
    """
    p = np.maximum(probability, CHANCE_MIN)
    result: Array = cost + price * (1.0 - probability) / p
    return result
