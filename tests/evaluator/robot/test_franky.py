"""An FR3, through its real client library, keeps the port's contract."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from emulator.kit import FR3, guard, tool
from emulator.process import Emulator

from shearline.evaluator.robot.port import Guard, RobotPort, Tool
from shearline.evaluator.robot.testing import RobotPortContract

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(FR3.missing()), reason=FR3.missing()),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Emulator]:
    with Emulator(FR3.version, tmp_path_factory.mktemp("franky") / "log") as emulator:
        yield emulator


class TestFR3(RobotPortContract):
    @pytest.fixture(autouse=True)
    def _where(self, robot: Emulator) -> None:
        robot.order("place")
        self.address = robot.address

    def make(self) -> Any:
        return FR3.make(self.address)

    def tool(self) -> Tool:
        return tool()

    def guard(self, port: RobotPort) -> Guard:
        assert port.joints == 7
        return guard(60.0)
