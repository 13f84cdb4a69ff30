"""What the robot's tests share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from emulator.kit import Kind, kinds
from emulator.process import Emulator
from evaluator.robot.rig import Rig, bounds, stage

from shearline.evaluator.robot.store import Store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    held = Store(tmp_path / "lab.state")
    yield held
    held.close()


@pytest.fixture
def rig(store: Store) -> Callable[..., Rig]:
    """Make an arm on a fresh stage."""

    def make(port: Any = None, **facts: Any) -> Rig:
        port = stage() if port is None else port
        return Rig(port, store, facts.pop("lab", bounds()), **facts)

    return make


@pytest.fixture(scope="module", params=kinds())
def kind(request: pytest.FixtureRequest) -> Kind:
    """Each of the two Frankas, skipped with the reason where its client cannot run."""
    chosen: Kind = request.param
    return chosen


@pytest.fixture(scope="module")
def robot(kind: Kind, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulator]:
    """That robot, emulated, for all tests of a file."""
    with Emulator(kind.version, tmp_path_factory.mktemp(kind.name) / "log") as emulator:
        yield emulator
