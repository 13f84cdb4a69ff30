"""A task of one's own: a bowl whose bottom is at the origin."""

import numpy as np

from shearline.evaluator import task


@task(space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)})
def bowl(theta: dict[str, float], rng: np.random.Generator) -> tuple[float, bool]:
    """Return the squared distance from the origin [m^2], with a little noise; always a success."""
    return theta["x"] ** 2 + theta["y"] ** 2 + 0.01 * float(rng.random()), True
