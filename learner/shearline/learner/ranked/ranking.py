"""The partition as a ranking: a support vector machine parts the elite from the rest.

Where the paper accepts or rejects a proposal by the sign of the decision function, its value is
used here to choose among proposals. It knows labels and tuples.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array
from shearline.learner.psp.config import PSPConfig
from shearline.learner.psp.machine import Machine, fit_machine
from shearline.learner.ranked.config import RankedConfig


def fit_ranking(z: Array, good: npt.NDArray[np.bool_], config: RankedConfig) -> Machine | None:
    """Fit the machine; ``None`` while all labels are the same.

    Args:
        z: Tuples ``(m, n)`` in deviations of the elite.
        good: Which of them are the elite ``(m,)``.
        config: C and kernel width.
    """
    if good.all() or not good.any():
        return None
    reading = PSPConfig(svm_c=config.svm_c, balanced=True, gammas=(config.svm_gamma / 12.0,))
    return fit_machine(z, good, reading)
