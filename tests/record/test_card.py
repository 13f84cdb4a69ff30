"""The card of a trial names everything with its unit, once."""

from collections.abc import Callable

from msgspec.structs import replace

from shearline.protocol.messages import Counted, Message
from shearline.record.card import card
from shearline.record.topics import RunConfig

CONFIG = RunConfig(
    run="r", text="", names=["a", "b"], units=["N", "m"], low=[0.0, -1.0], high=[4.0, 1.0], at_s=0.0
)


def an_outcome(messages: Callable[..., list[Message]]) -> Counted:
    return next(message for message in messages() if isinstance(message, Counted))


def test_a_card_shows_each_parameter_with_its_unit_and_place(
    messages: Callable[..., list[Message]],
) -> None:
    outcome = an_outcome(messages)
    text = card(replace(outcome, theta=[1.0, 1.0]), CONFIG)
    assert "| a | 1 | N | `---#--------` |" in text
    assert "| b | 1 | m | `-----------#` |" in text
    assert text.startswith(f"# Trial {outcome.trial}: {outcome.kind}")


def test_a_lost_trial_says_lost_and_why(messages: Callable[..., list[Message]]) -> None:
    outcome = an_outcome(messages)
    lost = replace(outcome, kind=None, why="3 attempts lost", evaluator="")
    assert card(lost, None).startswith("# Trial 0: lost (3 attempts lost)")


def test_without_names_parameters_are_numbered(messages: Callable[..., list[Message]]) -> None:
    outcome = an_outcome(messages)
    text = card(outcome, CONFIG)  # five values, two names: the names are of another run
    assert f"| x4 | {outcome.theta[4]:.4g} | | |" in text
