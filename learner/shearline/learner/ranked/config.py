"""Every number of the ranked learner, as one documented value."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

from shearline.learner.errors import SwitchError


@dataclass(frozen=True, slots=True)
class RankedConfig:
    """Switches and numbers.

    Attributes:
        refresh: Trials between two renewals of the model; 0 renews once per episode.
        wins_min: Successes from which there is a model; below, the space is scouted.
        scout_spread: Deviation, in edges of the cube, of scouts around a lone success.
        pessimism: Standard deviations by which success is taken below its estimate.
        spread: Factor on the deviations of the elite when drawing.
        draws: Proposals from which one trial is chosen.
        svm_c: Price of a sample on the wrong side of the partition.
        svm_gamma: Kernel width, times the number of parameters, on standardised tuples.
        window: Trials that reliability and ranking look at.
        cost_window: Successes that the cost looks at.
    """

    refresh: int = 0
    wins_min: int = 4
    scout_spread: float = 0.2
    pessimism: float = 0.5
    spread: float = 1.15
    draws: int = 30
    svm_c: float = 10.0
    svm_gamma: float = 0.3
    window: int = 1000
    cost_window: int = 240
    use_gp: bool = True
    use_p: bool = True
    use_svm: bool = True
    polish: int = 0

    def having(self, **switches: object) -> Self:
        """Return a copy with switches changed.

        Raises:
            SwitchError: If there is no such switch or it has no such value.
        """
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        for name, value in switches.items():
            if name not in known:
                raise SwitchError(
                    f"psp-ranked has no switch {name!r}: expected one of {', '.join(known)}"
                )
            known[name] = value
        return type(self)(**known)
