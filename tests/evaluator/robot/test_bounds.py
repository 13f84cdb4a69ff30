"""The lab's file: what it may say, and the one sentence that each mistake gets."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from evaluator.robot.rig import EXAMPLES, LAB, bounds
from hypothesis import given
from hypothesis import strategies as st

from shearline.evaluator.robot.bounds import parse_bounds, read_bounds
from shearline.evaluator.robot.errors import BoundsError
from shearline.evaluator.skill.parameters import BOUNDS

MISTAKES = {
    "[contact": "expected TOML",
    "": "missing required field",
    LAB + "[robots]\nx = 1": "unknown field",
    LAB.replace("force_n = 60.0", "force_n = 'much'"): "expected `float`",
    LAB.replace("force_n = 60.0", "force_n = nan"): "guard.force_n",
    LAB.replace("force_n = 60.0", "force_n = inf"): "finite",
    LAB.replace("force_n = 60.0", "force_n = -1.0"): "> 0",
    LAB.replace("force_n = 60.0", "force_n = 81.0"): "ceiling of 80",
    LAB.replace("force_n = 60.0", "force_n = 60.0\nspeed_mps = 0.3"): "ceiling of 0.25",
    LAB.replace("force_n = 60.0", "force_n = 60.0\nroi_m = 0.01"): "roi_m",
    LAB.replace("[0.2, -0.1, 0.05]", "[0.5, -0.1, 0.05]"): "is not below",
    LAB.replace("[start]", "[start]\nspeed_mps = 0.26"): "start.speed_mps = 0.26",
    LAB.replace("force_n = 60.0", "force_n = 60.0\ntorque_nm = 25.0"): "ceiling of 24",
    LAB + "[contact]\nreference_mps = 0.3": "contact.reference_mps = 0.3",
    LAB + "[contact]\nforce_max_n = 41.0": "ceiling of 40",
    LAB + "[contact]\ntorque_max_nm = 13.0": "ceiling of 12",
    LAB
    + "[contact]\nstiffness_max_npm = 1400.0\n[ranges]\ncon_k_xy = [100.0, 1000.0]\n"
    + "ins_k_xy = [50.0, 1000.0]": "below the 1500",
    LAB + "[contact]\nclip_m = 0.03": "is more than the 40",
    LAB + "[contact]\nclip_rad = 0.3": "is more than the 12",
    LAB + "[contact]\nstiffness_max_npm = 1600.0": "narrow ranges",
    LAB + "[contact]\nstiffness_max_nmprad = 100.0": "narrow ranges.ins_k_rot",
    LAB + "[contact]\nreference_hz = 1000.0": "reference_hz",
    LAB + "[contact]\ntrial_s = 61.0": "ceiling of 60",
    LAB + "[ranges]\nins_push = [0.0, 25.0]": "within the task's",
    LAB + "[ranges]\nins_push = [5.0, 5.0]": "is not a range",
    LAB + "[ranges]\nins_pusch = [0.0, 5.0]": "no parameter 'ins_pusch'",
    LAB + "[ranges]\nins_push = [0.0, 5.0]": "the canary's ins_push",
    "link_loss = 'shrug'\n" + LAB: "link_loss",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_is_one_sentence_that_names_the_file(text: str, tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text(text)
    with pytest.raises(BoundsError) as refused:
        read_bounds(path)
    said = str(refused.value)
    assert MISTAKES[text] in said
    assert str(path) in said
    assert "\n" not in said


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("none.toml", "there is no bounds file .*none.toml: copy docs/examples/lab.toml"),
        ("folder.toml", "the bounds file .*folder.toml cannot be read: Is a directory"),
        ("bytes.toml", "the bounds file .*bytes.toml is no text: expected TOML"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_sentence(name: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(BoundsError, match=f"^{why}[^\\n]*$") as refused:
        read_bounds(tmp_path / name)
    assert "Errno" not in str(refused.value)


@pytest.mark.parametrize("name", ["lab.toml", "stage.toml"])
def test_the_examples_are_sound(name: str) -> None:
    lab = read_bounds(EXAMPLES / name)
    assert lab.objection(lab.canary_tuple()) == ""
    assert lab.contact.stiffness_max_npm * lab.contact.clip_m <= lab.contact.force_max_n


def test_the_hash_changes_with_a_value_and_not_with_a_comment() -> None:
    plain = parse_bounds(LAB)
    assert parse_bounds("# mine\n" + LAB).hash == plain.hash
    assert parse_bounds(LAB.replace("force_n = 60.0", "force_n = 59.0")).hash != plain.hash
    assert len(plain.hash) == 12


@given(st.sampled_from(list(BOUNDS)), st.floats(allow_nan=True, allow_infinity=True))
def test_a_tuple_is_accepted_within_the_ranges_and_nowhere_else(name: str, value: float) -> None:
    lab = bounds()
    theta = lab.canary_tuple()
    theta[list(BOUNDS).index(name)] = value
    low, high = lab.range_of(name)
    inside = not math.isnan(value) and low <= value <= high
    assert (lab.objection(theta) == "") is inside


@pytest.mark.parametrize("n", [0, 22, 24])
def test_a_missing_or_an_extra_parameter_is_objected_to(n: int) -> None:
    assert "expected 23 parameters" in bounds().objection(np.zeros(n))
