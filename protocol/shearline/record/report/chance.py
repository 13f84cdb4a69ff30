"""How sure counts make: the interval of a success rate."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Standard deviations that hold 95 % of a normal distribution.
Z_95 = 1.959963984540054

Array = npt.NDArray[np.float64]


def wilson(successes: npt.ArrayLike, trials: npt.ArrayLike) -> tuple[Array, Array]:
    """Return the 95 % score interval of success rates.

    Wilson, *Probable inference, the law of succession, and statistical inference*, Journal of
    the American Statistical Association 22 (1927): near its level for few trials too, and never
    beyond 0 and 1.

    Args:
        successes: ``(...)``.
        trials: ``(...)``; where it is 0 the interval is 0 to 1.

    Returns:
        Lower and upper ends ``(...)``, 0 to 1.
    """
    won, n = np.asarray(successes, dtype=np.float64), np.asarray(trials, dtype=np.float64)
    some = np.maximum(n, 1.0)
    rate, square = won / some, Z_95**2
    middle = (rate + square / (2.0 * some)) / (1.0 + square / some)
    spread = np.sqrt(rate * (1.0 - rate) / some + square / (4.0 * some**2))
    reach = Z_95 * spread / (1.0 + square / some)
    low = np.where(won <= 0.0, 0.0, np.maximum(middle - reach, 0.0))
    high = np.where(won >= n, 1.0, np.minimum(middle + reach, 1.0))
    return np.where(n > 0.0, low, 0.0), np.where(n > 0.0, high, 1.0)
