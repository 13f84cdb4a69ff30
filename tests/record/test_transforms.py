"""Transforms laid out by hand are what protobuf itself would read, moment by moment."""

import functools
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.messages import TraceData
from shearline.protocol.pose import Placed
from shearline.protocol.scene import Body, Joint, SceneData
from shearline.record.schemas import file_set
from shearline.record.transforms import MOMENTS_MAX, ROOT, fixed_transforms, motion

NOW_NS = 1_795_000_000_987_654_321


def body(name: str, parent: str, joint: Joint, column: str) -> Body:
    return Body(
        name=name,
        parent=parent,
        position=[0.25, -0.5, 0.125],
        quaternion=[0.0, 0.0, 0.0, 1.0],
        joint=joint,
        axis=[0.0, 0.0, 1.0],
        column=column,
        shapes=[],
    )


#: The long name makes a field's length take two bytes.
LONG = "n" * 64
SCENE = SceneData(
    bodies=[
        body(ROOT, "", Joint.FIXED, ""),
        body("lock", ROOT, Joint.FIXED, ""),
        body("arm", ROOT, Joint.HINGE, "q.1"),
        body(LONG, "arm", Joint.SLIDE, "pin.1"),
    ]
)
LOCK = Placed(body="lock", position=[0.5, 0.0, 0.0], quaternion=[1.0, 0.0, 0.0, 0.0])


@functools.cache
def kind() -> Any:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(file_set("foxglove.FrameTransforms")).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName("foxglove.FrameTransforms"))


def parsed(data: bytes) -> Any:
    return kind().FromString(data)


def a_trace(samples: int, span_s: float) -> TraceData:
    t_s = np.linspace(0.0, span_s, samples)
    data = np.stack([t_s, 0.1 * t_s, 0.001 * t_s]).astype("<f4")
    return TraceData(
        trial=1,
        token="token-01",
        samples=samples,
        names=["t_s", "q.1", "pin.1"],
        units=["s", "rad", "m"],
        data=data.tobytes(),
        placed=[LOCK],
    )


def test_every_body_of_every_moment_comes_back() -> None:
    found = [
        t for _, d in motion(SCENE, a_trace(1000, 2.0), 0, NOW_NS) for t in parsed(d).transforms
    ]
    assert {t.child_frame_id for t in found} == {"lock", "arm", LONG}
    arms = [t for t in found if t.child_frame_id == "arm"]
    assert {t.parent_frame_id for t in found if t.child_frame_id == LONG} == {"arm"}
    assert len(arms) == 101  # 50 a second
    assert [arms[0].translation.x, arms[0].translation.y, arms[0].translation.z] == [
        0.25,
        -0.5,
        0.125,
    ]
    assert np.isclose(arms[-1].rotation.z, np.sin(0.1), atol=1e-6)
    assert np.isclose(arms[-1].rotation.w, np.cos(0.1), atol=1e-6)
    last = next(t for t in reversed(found) if t.child_frame_id == LONG)
    assert np.isclose(last.translation.z, 0.125 + 0.002, atol=1e-6)
    assert all(t.rotation.x == 1.0 for t in found if t.child_frame_id == "lock")


@given(span_s=st.floats(0.001, 100.0), gap_ns=st.integers(1, 10**11), samples=st.integers(1, 300))
def test_moments_lie_between_the_trial_before_and_the_arrival_and_never_run_back(
    span_s: float, gap_ns: int, samples: int
) -> None:
    said = list(motion(SCENE, a_trace(samples, span_s), NOW_NS - gap_ns, NOW_NS))
    moments = [
        t.timestamp.seconds * 10**9 + t.timestamp.nanos
        for _, d in said
        for t in parsed(d).transforms
    ]
    assert moments == sorted(moments)
    assert NOW_NS - gap_ns <= moments[0] <= moments[-1] == NOW_NS
    # the trial's clock is in float32
    assert moments[-1] - moments[0] <= span_s * 1e9 * (1.0 + 1e-6)
    assert [at_ns for at_ns, _ in said] == sorted(at_ns for at_ns, _ in said)


def test_a_trial_of_an_hour_is_spread_wider() -> None:
    trace = a_trace(5000, 3600.0)
    found = [t for _, d in motion(SCENE, trace, 0, NOW_NS) for t in parsed(d).transforms]
    assert len(found) == 3 * MOMENTS_MAX


def test_a_trace_that_moves_nothing_says_nothing() -> None:
    still = SceneData(bodies=[body("lock", "", Joint.FIXED, "")])
    assert list(motion(still, a_trace(10, 1.0), 0, NOW_NS)) == []


def test_what_never_moves_is_said_once_with_the_rest() -> None:
    found = parsed(fixed_transforms(SCENE, NOW_NS)).transforms
    assert [t.child_frame_id for t in found] == ["lock", "arm", LONG]
    assert found[0].parent_frame_id == ROOT
    assert found[0].timestamp.nanos == NOW_NS % 10**9
