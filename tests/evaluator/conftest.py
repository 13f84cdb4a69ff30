"""What tests of the worker share."""

from collections.abc import Iterator

import pytest
from evaluator.tiny_learner import TinyLearner

from shearline.protocol.endpoints import free_endpoint


@pytest.fixture
def learner() -> Iterator[TinyLearner]:
    with TinyLearner(free_endpoint()) as learner:
        yield learner
