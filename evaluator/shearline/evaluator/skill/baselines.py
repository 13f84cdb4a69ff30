"""What the task costs without learning: the rows that every table of learners starts with.

    python -m shearline.evaluator.skill.baselines --tuples 200 --trials 100

prints one JSON object for each row. ``lhs``: a latin hypercube over the bounds, each tuple once;
``centre`` and ``centre-push``: the middle of the box, as it is and with a push of 19 N; ``swift``
and ``gentle``: two tuples set by hand, a firm one and a slow one.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter

import numpy as np

from shearline.evaluator.base import Array
from shearline.evaluator.keylock import KeylockTask
from shearline.evaluator.keylock_variation import LEVELS
from shearline.evaluator.skill.parameters import space

_SMOOTH = {"xi": 1.1, "ins_k_rot": 40.0, "ins_k_xy": 800.0}
_WIGGLE = {"wig_a_x": 1.0, "wig_a_y": 3.0, "wig_a_rx": 1.5, "wig_a_ry": 1.5}
_QUICK = dict.fromkeys(("wig_f_x", "wig_f_y", "wig_f_rx", "wig_f_ry"), 2.5)
_HAND_SET = _SMOOTH | _WIGGLE | _QUICK

#: What differs from the middle of the box.
TUPLES: dict[str, dict[str, float]] = {
    "centre": {},
    "centre-push": {"ins_push": 19.0},
    "swift": _HAND_SET | {"ins_push": 19.5, "ins_speed": 0.06, "con_speed": 0.05},
    "gentle": _HAND_SET | {"ins_push": 14.0, "ins_speed": 0.03, "con_speed": 0.02},
}


def latin_hypercube(count: int, seed: int) -> Array:
    """Return tuples ``(count, 23)`` in task units, one in each of ``count`` strata of each axis."""
    rng = np.random.default_rng(seed)
    axes = len(space())
    strata = np.array([rng.permutation(count) for _ in range(axes)]).T
    return space().denormalise((strata + rng.uniform(size=(count, axes))) / count)


def tuple_of(changes: dict[str, float]) -> Array:
    """Return the middle of the box ``(23,)`` with ``changes``."""
    centre = space().to_dict(space().denormalise(np.full(len(space()), 0.5)))
    return space().to_array(centre | changes)


def row(task: KeylockTask, thetas: Array, first_seed: int = 1000) -> dict[str, object]:
    """Try each tuple of ``thetas (trials, 23)`` once and sum up."""
    found = [task.run(theta, first_seed + i, lambda: None) for i, theta in enumerate(thetas)]
    costs = [outcome.cost for outcome in found if outcome.success]
    return {
        "success": len(costs) / len(found),
        "cost": float(np.mean([outcome.cost for outcome in found])),
        "cost_of_successes": float(np.mean(costs)) if costs else None,
        "cost_quantiles": np.quantile(costs, (0.1, 0.5, 0.9)).round(3).tolist() if costs else None,
        "failures": dict(Counter(outcome.why for outcome in found if not outcome.success)),
    }


def main(arguments: list[str] | None = None) -> int:
    """Print the rows and return an exit code."""
    parser = argparse.ArgumentParser(description="Measure the key-in-lock task without learning.")
    parser.add_argument("tasks", nargs="*", default=list(LEVELS), help="default: the plain levels")
    parser.add_argument("--tuples", type=int, default=200, help="tuples of the latin hypercube")
    parser.add_argument("--trials", type=int, default=100, help="trials of each fixed tuple")
    options = parser.parse_args(arguments)
    for name in options.tasks:
        task = KeylockTask(name)
        rows = {"lhs": latin_hypercube(options.tuples, 0)}
        rows |= {key: np.tile(tuple_of(c), (options.trials, 1)) for key, c in TUPLES.items()}
        for key, thetas in rows.items():
            line = {"level": name, "tuple": key} | row(task, thetas)
            sys.stdout.write(json.dumps(line) + "\n")
            sys.stdout.flush()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
