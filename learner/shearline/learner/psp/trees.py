"""Partitioners made of decision trees: a random forest and gradient boosting.

They are fitted by scikit-learn and evaluated here, all trees at once: the library's own call
costs milliseconds whatever its size, and a filter judges a few proposals at a time. They know
labels and tuples, not rewards or costs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from shearline.learner.base import Array

#: Trees of either kind, the library's default; more changed nothing at a run's size.
TREES = 100

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Trees:
    """A decision function ``f(u) = offset + sum_t value(leaf of tree t that u falls into)``.

    The nodes of all trees lie one after another.

    Attributes:
        root: First node of each tree ``(t,)``.
        feature: Parameter that a node asks for ``(k,)``; -1 in a leaf.
        threshold: Up to which value it sends a tuple to the left ``(k,)``.
        left: Where that leads ``(k,)``; a leaf leads to itself.
        right: Where more than that leads ``(k,)``.
        value: What a leaf adds ``(k,)``.
        offset: Constant term.
    """

    kind: ClassVar[str] = "trees"

    root: Indices
    feature: Indices
    threshold: Array
    left: Indices
    right: Indices
    value: Array
    offset: float

    def decision(self, u: Array) -> Array:
        """Return ``f`` of tuples ``(m, n)`` as ``(m,)``; at least 0 means accepted."""
        # The library compares in single precision; so a tuple on an edge falls to the same side.
        single = u.astype(np.float32)
        rows = np.arange(len(u))[:, None]
        node = np.tile(self.root, (len(u), 1))
        while np.any(self.feature[node] >= 0):
            goes_left = single[rows, self.feature[node]] <= self.threshold[node]
            node = np.where(goes_left, self.left[node], self.right[node])
        result: Array = self.offset + self.value[node].sum(axis=1)
        return result

    def snapshot(self) -> Mapping[str, object]:
        """Return the function as plain values."""
        return {
            "kind": self.kind,
            "root": self.root.tolist(),
            "feature": self.feature.tolist(),
            "threshold": self.threshold.tolist(),
            "left": self.left.tolist(),
            "right": self.right.tolist(),
            "value": self.value.tolist(),
            "offset": self.offset,
        }

    @classmethod
    def restored(cls, snapshot: Mapping[str, Any]) -> Self:
        """Return the function of a snapshot."""
        return cls(
            root=np.array(snapshot["root"], dtype=np.int64),
            feature=np.array(snapshot["feature"], dtype=np.int64),
            threshold=np.array(snapshot["threshold"], dtype=np.float64),
            left=np.array(snapshot["left"], dtype=np.int64),
            right=np.array(snapshot["right"], dtype=np.int64),
            value=np.array(snapshot["value"], dtype=np.float64),
            offset=float(snapshot["offset"]),
        )


def fit_forest(u: Array, good: npt.NDArray[np.bool_], seed: int, *, balanced: bool) -> Trees:
    """Fit a random forest; the decision is the share of good it sees, less one half.

    Args:
        u: Samples ``(m, n)``.
        good: Their labels ``(m,)``, of both kinds.
        seed: For the samples and parameters that each tree sees.
        balanced: Whether both classes weigh the same.
    """
    from sklearn.ensemble import RandomForestClassifier  # noqa: PLC0415 - heavy, at the first fit

    weights = "balanced" if balanced else None
    forest = RandomForestClassifier(n_estimators=TREES, class_weight=weights, random_state=seed)
    forest.fit(u, good)
    trees = [one.tree_ for one in forest.estimators_]
    shares = [tree.value[:, 0, 1] / tree.value[:, 0].sum(axis=1) for tree in trees]
    return _joined(trees, [share / len(trees) for share in shares], -0.5)


def fit_boosting(u: Array, good: npt.NDArray[np.bool_], seed: int, *, balanced: bool) -> Trees:
    """Fit gradient boosted trees; the decision is their log odds of good.

    An update sees a thousand samples at most, so that the exact method is as fast as the one on
    histograms, and its trees are open to the reader.

    Args:
        u: Samples ``(m, n)``.
        good: Their labels ``(m,)``, of both kinds.
        seed: For ties between splits.
        balanced: Whether both classes weigh the same.
    """
    from sklearn.ensemble import (  # noqa: PLC0415 - heavy, at the first fit
        GradientBoostingClassifier,
    )

    boosting = GradientBoostingClassifier(n_estimators=TREES, random_state=seed)
    boosting.fit(u, good, sample_weight=class_weights(good) if balanced else None)
    trees = [one.tree_ for one in boosting.estimators_[:, 0]]
    values = [boosting.learning_rate * tree.value[:, 0, 0] for tree in trees]
    # What the trees of one tuple leave open is the constant that boosting began with.
    begun = _joined(trees, values, 0.0)
    offset = float(boosting.decision_function(u[:1])[0] - begun.decision(u[:1])[0])
    return _joined(trees, values, offset)


def class_weights(good: npt.NDArray[np.bool_]) -> Array:
    """Return a weight for each sample ``(m,)``, so that both classes weigh the same."""
    share = float(good.mean())
    return np.where(good, 0.5 / share, 0.5 / (1.0 - share))


def _joined(trees: Sequence[Any], values: Sequence[Array], offset: float) -> Trees:
    """Return the library's trees with their nodes in one line."""
    sizes = [tree.node_count for tree in trees]
    root = np.cumsum([0, *sizes[:-1]])
    own = [np.arange(size) for size in sizes]
    leaf = [tree.children_left < 0 for tree in trees]

    def moved(side: str) -> Indices:
        steps = [
            np.where(end, k, getattr(t, side)) for end, k, t in zip(leaf, own, trees, strict=True)
        ]
        return np.concatenate([step + at for step, at in zip(steps, root, strict=True)])

    return Trees(
        root=root,
        feature=np.concatenate(
            [np.where(e, -1, t.feature) for e, t in zip(leaf, trees, strict=True)]
        ),
        threshold=np.concatenate([tree.threshold for tree in trees]),
        left=moved("children_left"),
        right=moved("children_right"),
        value=np.concatenate(values),
        offset=offset,
    )
