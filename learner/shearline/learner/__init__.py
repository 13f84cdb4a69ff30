"""Propose tuples and keep the run: learners, dispatcher, journal.

::

    from shearline.learner import create, Space

    learner = create("psp", Space.box(20, -5, 5), episode_length=40, seed=0)
    for proposal in learner.ask(40):
        learner.tell(proposal.trial, cost=..., success=...)
    best = learner.recommend()

Importing this costs numpy and nothing heavier; scikit-learn comes with the first fit.
"""

from shearline.learner.base import Learner, Proposal, Recommendation
from shearline.learner.errors import LearnerError, SwitchError, UnknownLearnerError
from shearline.learner.region import Region
from shearline.learner.registry import create, names
from shearline.protocol.space import Space

__all__ = [
    "Learner",
    "LearnerError",
    "Proposal",
    "Recommendation",
    "Region",
    "Space",
    "SwitchError",
    "UnknownLearnerError",
    "create",
    "names",
]
