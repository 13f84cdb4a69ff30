"""Poses laid out by hand are what protobuf itself would write and read."""

from typing import Any

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from hypothesis import given
from hypothesis import strategies as st

from shearline.protocol.messages import TraceData
from shearline.record.foxglove import TIP_POSES_MAX, tip_poses
from shearline.record.schemas import file_set


@pytest.fixture(scope="module")
def kind() -> Any:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(file_set("foxglove.PosesInFrame")).file:
        pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName("foxglove.PosesInFrame"))


def a_trace(samples: int, *names: str) -> TraceData:
    data = np.arange(len(names) * samples, dtype="<f4") * np.float32(0.1) + np.float32(1.0)
    return TraceData(
        trial=1,
        token="token-01",
        samples=samples,
        names=list(names),
        units=["m"] * len(names),
        data=data.tobytes(),
    )


@given(samples=st.integers(1, 3 * TIP_POSES_MAX))
def test_every_pose_comes_back_where_the_tip_was(kind: Any, samples: int) -> None:
    trace = a_trace(samples, "t_s", "tip.x", "tip.y", "tip.z")
    columns = np.frombuffer(trace.data, dtype="<f4").reshape(4, samples)
    read = kind.FromString(tip_poses(trace))
    assert 1 <= len(read.poses) <= TIP_POSES_MAX
    every = -(-samples // TIP_POSES_MAX)
    expected = columns[1:, ::every].T.tolist()
    assert [[p.position.x, p.position.y, p.position.z] for p in read.poses] == expected
    assert {p.orientation.w for p in read.poses} == {1.0}
    assert read.SerializeToString() == tip_poses(trace)  # not a byte more than protobuf's own


def test_a_trace_without_a_tip_has_no_path() -> None:
    assert tip_poses(a_trace(5, "t_s", "tip.x", "tip.y")) == b""
    assert tip_poses(a_trace(0, "t_s", "tip.x", "tip.y", "tip.z")) == b""
