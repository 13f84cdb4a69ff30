"""Particle swarm optimisation, the paper's appendix A.3, equations (10) and (11) as printed.

Every particle has one trial in each episode. It is drawn to the best place that it knows and to
the best that the whole swarm knows. It knows costs and tuples, no model of either.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shearline.learner.base import Array
from shearline.learner.charge import Failures, charged
from shearline.learner.episodic import EpisodicLearner
from shearline.learner.ledger import Trials
from shearline.learner.psp.proposal import reflect
from shearline.learner.recommend import ON_POLICY_TRIALS, Focus, elite_focus
from shearline.learner.switches import check, having, plain
from shearline.protocol.space import Space


class Draws(enum.StrEnum):
    """What r_1 and r_2 of equation (10) are drawn for."""

    COORDINATE = "coordinate"  # usual since Kennedy and Eberhart (1995)
    PARTICLE = "particle"  # one number each, as the equation can be read


class Walls(enum.StrEnum):
    """What happens to a particle that would leave the cube."""

    CLIP = "clip"  # it waits at the wall and keeps its velocity
    STOP = "stop"  # it loses the velocity across the wall
    REFLECT = "reflect"  # it is mirrored and keeps its velocity


@dataclass(frozen=True, slots=True)
class PSOConfig:
    """What appendix A.3 leaves open, and the constants it gives.

    Attributes:
        inertia: w; 1 in the paper.
        own: c_1, pull of a particle's own best place; 1 in the paper.
        swarm: c_2, pull of the swarm's best place; 1 in the paper.
        draws: What r_1 and r_2 are drawn for.
        speed: Largest velocity at the start along each axis, in cube edges per episode.
        walls: What happens at the walls.
        failures: Whether failures differ among themselves; only then can one be a best place.
    """

    inertia: float = 1.0
    own: float = 1.0
    swarm: float = 1.0
    draws: Draws = Draws.COORDINATE
    speed: float = 0.0
    walls: Walls = Walls.CLIP
    failures: Failures = Failures.ALIKE

    def __post_init__(self) -> None:
        check(self.inertia >= 0, "pso", "inertia", "0 or more", self.inertia)
        check(self.own >= 0, "pso", "own", "0 or more", self.own)
        check(self.swarm >= 0, "pso", "swarm", "0 or more", self.swarm)
        check(self.speed >= 0, "pso", "speed", "0 or more", self.speed)


class ParticleSwarm(EpisodicLearner):
    """A swarm of as many particles as an episode has trials; they begin uniformly spread.

    After another run each begins at the best place that its trials there found, where one did.

    Args:
        space: What is being learned.
        episode_length: Number of particles.
        seed: 0 or more.
        switches: Fields of :class:`PSOConfig`.
    """

    name = "pso"
    primes = True

    def __init__(
        self, space: Space, episode_length: int = 20, seed: int = 0, **switches: object
    ) -> None:
        super().__init__(space, episode_length, seed)
        self.config = having(PSOConfig(), self.name, switches)
        self._place = np.empty((0, len(space)))
        self._velocity = np.empty((0, len(space)))

    def _begin(self, episode: int, trials: Trials, rng: np.random.Generator) -> None:
        shape = (self.episode_length, len(self.space))
        if episode == 0:
            self._place, _ = best_places(trials, rng.random(shape), self.config.failures)
            self._velocity = self.config.speed * rng.uniform(-1.0, 1.0, shape)
            return
        own, swarm = best_places(trials, self._place, self.config.failures)
        pulled = pull(self._place, self._velocity, own, swarm, rng, self.config)
        self._place, self._velocity = move(self._place, pulled, self.config.walls)

    def _draw(self, index: int, rng: np.random.Generator) -> Array:
        del rng
        return np.array(self._place[index])

    def _focus(self, trials: Trials) -> Focus:
        """Return the middle of the cheaper half of the latest successes."""
        return elite_focus(trials.last(ON_POLICY_TRIALS), len(self.space))

    def _model(self) -> Mapping[str, object]:
        swarm = {"u": self._place.tolist(), "velocity": self._velocity.tolist()}
        return {"config": plain(self.config), "swarm": swarm}


def best_places(trials: Trials, place: Array, failures: Failures) -> tuple[Array, Array]:
    """Return what the particles know.

    Trial k belongs to particle k modulo the number of particles, also when it was told late. Ties
    go to the earlier trial.

    Args:
        trials: Everything told.
        place: Where the particles are ``(p, n)``.
        failures: Whether a failure can be a best place.

    Returns:
        The best place of each particle ``(p, n)`` and of the swarm for each ``(p, n)``; where
        nothing is known it is the particle's own place, which does not pull.
    """
    own, swarm = place.copy(), place.copy()
    cost = charged(trials, failures)
    count = np.ones(len(trials), dtype=np.bool_)
    known = np.flatnonzero(trials.success if failures is Failures.ALIKE else count)
    # From the dearest to the cheapest, so that the last one written is the best.
    worst_first = known[np.argsort(cost[known], kind="stable")[::-1]]
    for k in worst_first:
        own[trials.number[k] % len(place)] = trials.u[k]
    if len(worst_first):
        swarm[:] = trials.u[worst_first[-1]]
    return own, swarm


def pull(
    place: Array,
    velocity: Array,
    own: Array,
    swarm: Array,
    rng: np.random.Generator,
    config: PSOConfig,
) -> Array:
    """Return equation (10), ``w v + c_1 r_1 (p_i - x) + c_2 r_2 (p_g - x)``, as ``(p, n)``."""
    shape = (len(place), place.shape[1] if config.draws is Draws.COORDINATE else 1)
    r_own, r_swarm = rng.random(shape), rng.random(shape)
    result: Array = (
        config.inertia * velocity
        + config.own * r_own * (own - place)
        + config.swarm * r_swarm * (swarm - place)
    )
    return result


def move(place: Array, velocity: Array, walls: Walls) -> tuple[Array, Array]:
    """Return places and velocities ``(p, n)`` after equation (11), ``x + v``, within the cube."""
    ahead = place + velocity
    if walls is Walls.REFLECT:
        return reflect(ahead), velocity
    inside = np.clip(ahead, 0.0, 1.0)
    if walls is Walls.STOP:
        velocity = np.where(inside == ahead, velocity, 0.0)
    return inside, velocity
