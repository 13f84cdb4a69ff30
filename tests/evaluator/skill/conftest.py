"""One warm task for all tests of the skill: compiling it is what takes time."""

from __future__ import annotations

import pytest

from shearline.evaluator.keylock import KeylockTask


@pytest.fixture(scope="session")
def task() -> KeylockTask:
    task = KeylockTask()
    task.warm()
    return task
