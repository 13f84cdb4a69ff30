"""Plants by name: what a built-in task acts on is the evaluator's choice and no part of the task.

Learner and evaluators compare what is learned, not what it is tried on; so evaluators with
different plants may serve one learner, and every outcome names its engine.
"""

from __future__ import annotations

#: What ``--plant`` takes. An engine's fingerprint begins with the name of its plant.
PLANTS = ("mujoco", "pybullet")

#: The plant that is meant where none is named.
DEFAULT = "mujoco"


def plant_of(engine: str) -> str:
    """Return the plant behind an engine's fingerprint; :data:`DEFAULT` where it has none.

    Example:
        >>> plant_of("pybullet 3.2.7 model 0a1b2c3d4e5f skill 1")
        'pybullet'
    """
    name = engine.partition(" ")[0]
    return name if name in PLANTS else DEFAULT
