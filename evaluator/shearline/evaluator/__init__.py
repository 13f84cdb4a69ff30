"""Run trials: tasks, skills and the worker that speaks to a learner.

::

    from shearline.evaluator import task

    @task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)})
    def bowl(theta, rng):
        return theta["x"] ** 2 + theta["y"] ** 2, True
"""

from shearline.evaluator.base import Outcome, Task, Trace, TrialAborted
from shearline.evaluator.tasks import load_task, task

__all__ = ["Outcome", "Task", "Trace", "TrialAborted", "load_task", "task"]
