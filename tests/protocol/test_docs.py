"""The protocol's page says what the code does."""

import re
import subprocess
import sys
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest

from shearline.protocol import link
from shearline.protocol.codec import BY_TOPIC, TO_EVALUATOR, TO_LEARNER, TO_OBSERVER, decode, encode
from shearline.protocol.endpoints import free_endpoint
from shearline.protocol.keys import Keys, parse
from shearline.protocol.link import open_router
from shearline.protocol.messages import (
    Ack,
    Bye,
    Command,
    CommandKind,
    Credit,
    Hello,
    Message,
    OutcomeKind,
    Result,
    Trial,
    Verdict,
    Welcome,
)
from shearline.protocol.task import TaskSpec

PAGE = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text(encoding="utf-8")
TASK = TaskSpec(name="bowl", space={"x": ("m", -5.0, 5.0), "y": ("m", -5.0, 5.0)})
WAIT_S = 10.0


@pytest.mark.parametrize("kind", [*TO_LEARNER, *TO_EVALUATOR], ids=lambda kind: kind.__name__)
def test_every_field_of_a_control_message_is_on_the_page(kind: type[Message]) -> None:
    tag = kind.__struct_config__.tag
    row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{tag}` |"))
    assert set(kind.__struct_fields__) <= set(re.findall(r"`(\w+)`", row))


def test_every_message_to_observers_and_every_topic_is_on_the_page() -> None:
    for kind in TO_OBSERVER:
        assert f"`{kind.__struct_config__.tag}`" in PAGE
    for topic in BY_TOPIC:
        assert f"`{topic}`" in PAGE or f"/{topic}`" in PAGE


def test_every_common_setting_is_on_the_page() -> None:
    table = PAGE.partition("## Settings")[2].partition("## Traps")[0]
    for path in link._COMMON:
        assert any(part in table for part in (path, path.rsplit("/", 1)[0], path.rsplit("/", 1)[1]))


def test_the_evaluator_on_the_page_takes_part_in_a_run(tmp_path: Path) -> None:
    pytest.importorskip("zenoh")
    script = tmp_path / "tiny.py"
    code = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert code is not None
    script.write_text(code[1], encoding="utf-8")
    endpoint, keys = free_endpoint(), Keys("run-1")
    inbox: SimpleQueue[Any] = SimpleQueue()
    heard: list[type[Message]] = []

    def say(message: Message) -> None:
        router.publish(keys.down("tiny", message), encode(message))

    with open_router(endpoint) as router:
        router.subscribe(keys.from_evaluators(), inbox)
        router.announce(keys.live_learner(1))
        with subprocess.Popen([sys.executable, str(script), endpoint]) as process:
            while Bye not in heard:
                arrival = inbox.get(timeout=WAIT_S)
                message = decode(arrival.payload, *BY_TOPIC[parse(arrival.key).topic])
                heard.append(type(message))
                match message:
                    case Hello(boot=boot):
                        say(Welcome(boot=boot, epoch=1, task=TASK, lease_s=2.0))
                    case Credit(boot=boot) if heard.count(Credit) == 1:
                        say(_trial(boot))
                    case Result(boot=boot, token=token, kind=OutcomeKind.SUCCESS, cost=cost):
                        assert cost == 5.0
                        say(Ack(boot=boot, token=token, verdict=Verdict.COUNTED))
                        stop = Command(kind=CommandKind.STOP)
                        router.publish(keys.all_cmd(), encode(stop))
            assert process.wait(WAIT_S) == 0
    assert {Hello, Credit, Result, Bye} <= set(heard)


def _trial(boot: str) -> Trial:
    return Trial(
        boot=boot,
        epoch=1,
        trial=0,
        episode=0,
        attempt=1,
        token="token-01",
        theta=[1.0, 2.0],
        seed=1,
        lease_s=2.0,
        deadline_s=10.0,
    )
