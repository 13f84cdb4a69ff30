"""A Panda, through its real client library, keeps the port's contract."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from emulator.kit import PANDA, guard, tool
from emulator.process import Emulator

from shearline.evaluator.robot.port import Guard, RobotPort, Tool
from shearline.evaluator.robot.testing import RobotPortContract

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(PANDA.missing()), reason=PANDA.missing()),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulator]:
    with Emulator(PANDA.version, tmp_path_factory.mktemp("panda") / "log") as emulator:
        yield emulator


class TestPanda(RobotPortContract):
    @pytest.fixture(autouse=True)
    def _where(self, robot: Emulator) -> None:
        robot.order("place")
        self.address = robot.address

    def make(self) -> Any:
        return PANDA.make(self.address)

    def tool(self) -> Tool:
        return tool()

    def guard(self, port: RobotPort) -> Guard:
        assert port.joints == 7
        return guard(60.0)
