"""The example of a robot of one's own keeps the port's contract, in few lines."""

from __future__ import annotations

from pathlib import Path

from evaluator.robot.rig import EXAMPLES, bounds, stage

from shearline.evaluator.robot.port import Guard, RobotPort
from shearline.evaluator.robot.testing import RobotPortContract


class TestStage(RobotPortContract):
    def make(self) -> RobotPort:
        port: RobotPort = stage()
        return port

    def guard(self, port: RobotPort) -> Guard:  # noqa: ARG002
        return bounds().port_guard()


def test_the_example_attaches_a_robot_in_less_than_sixty_lines() -> None:
    text = Path(EXAMPLES / "stage.py").read_text()
    body = text[text.index("class Stage") :].splitlines()
    assert len([line for line in body if line.strip()]) < 60
