"""Levels with switches: one name for one task, and plain levels that stay what they were."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.builtin import builtin_spec, builtin_task
from shearline.evaluator.keylock_spec import keylock_spec
from shearline.evaluator.keylock_variation import LEVELS, SWITCHES, canonical, level
from shearline.protocol.errors import ConfigError
from shearline.protocol.task import digest

#: What evaluators and learners of earlier versions call the plain levels.
DIGESTS = {
    "keylock": "7b0b354cdcca1df6",
    "keylock-limit": "7866ab0e371fd816",
    "keylock-jam": "2377d6488f32ad5e",
}

switches = st.lists(st.sampled_from([s for s in SWITCHES if s != "key-c"]), unique=True)


@pytest.mark.parametrize(("name", "known"), DIGESTS.items())
def test_a_plain_level_is_the_task_it_always_was(name: str, known: str) -> None:
    assert digest(keylock_spec(name)) == known


@given(chosen=switches, data=st.data())
def test_the_order_of_switches_is_no_part_of_the_task(
    chosen: list[str], data: st.DataObject
) -> None:
    shuffled = data.draw(st.permutations(chosen))
    one, other = ("+".join(["keylock", *words]) for words in (chosen, shuffled))
    assert canonical(one) == canonical(other)
    assert keylock_spec(one) == keylock_spec(other)
    assert level(one) == level(canonical(one))


@given(chosen=switches)
def test_every_choice_of_switches_is_a_task_of_its_own(chosen: list[str]) -> None:
    specs = {
        digest(keylock_spec("+".join(["keylock", *chosen[:count]])))
        for count in range(len(chosen) + 1)
    }
    assert len(specs) == len(chosen) + 1


def test_jam_is_limit_with_more_play_and_the_switches_friction_and_pins() -> None:
    jam = LEVELS["keylock-jam"]
    assert level("keylock-limit+friction+pins") == replace(
        jam, offset_m=LEVELS["keylock"].offset_m, tilt_rad=LEVELS["keylock"].tilt_rad
    )


def test_a_name_with_switches_is_a_builtin_and_comes_out_in_the_usual_order() -> None:
    spec = builtin_spec("keylock+noise+grasp")
    assert spec.name == "keylock+grasp+noise"
    assert builtin_task(spec.name).spec == spec


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("keylok+grasp", "no key-in-lock level 'keylok'"),
        ("keylock+grip", "no switch 'grip': expected some of friction, pins, grasp"),
        ("keylock+", "no switch ''"),
        ("keylock-jam+friction", "has friction already"),
        ("keylock+grasp+grasp", "given twice"),
        ("keylock+key-b+key-c", "a lock has one key"),
    ],
)
def test_a_name_that_says_nothing_or_too_much_is_refused(name: str, why: str) -> None:
    with pytest.raises(ConfigError, match=why.replace("+", r"\+")):
        keylock_spec(name)
