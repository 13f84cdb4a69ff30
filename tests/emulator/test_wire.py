"""The sizes that the real clients insist on, and what they load."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from emulator import model
from emulator.wire import FR3, PANDA

from shearline.sims.panda import flange_pose
from shearline.sims.scene import Q_START

SYMBOLS = [
    *(f"{kind}{frame}" for kind in ("O_T_J", "O_J_J", "Ji_J_J") for frame in range(1, 10)),
    *("M_NE", "c_NE", "g_NE"),
]


def test_states_and_commands_have_the_sizes_that_the_clients_expect() -> None:
    assert (FR3.state.itemsize, FR3.command.itemsize) == (1377, 371)
    assert (PANDA.state.itemsize, PANDA.command.itemsize) == (2373, 370)


@pytest.mark.skipif(model.COMPILER is None, reason="no C compiler on this machine")
def test_the_library_of_a_panda_has_its_thirty_functions_and_knows_where_the_flange_is(
    tmp_path: Path,
) -> None:
    path = tmp_path / "model.so"
    path.write_bytes(model.library())
    library = ctypes.CDLL(str(path))
    assert len(SYMBOLS) == 30
    assert all(hasattr(library, name) for name in SYMBOLS)
    pose = np.zeros(16)
    q = np.array(Q_START)
    library.O_T_J8(q.ctypes.data_as(ctypes.c_void_p), pose.ctypes.data_as(ctypes.c_void_p))
    position, rotation = flange_pose(q)
    assert np.allclose(pose.reshape(4, 4).T[:3, 3], position)
    assert np.allclose(pose.reshape(4, 4).T[:3, :3], rotation)


@pytest.mark.skipif(model.COMPILER is None, reason="no C compiler on this machine")
def test_the_librarys_jacobian_is_the_derivative_of_its_pose(tmp_path: Path) -> None:
    path = tmp_path / "model.so"
    path.write_bytes(model.library())
    library = ctypes.CDLL(str(path))
    ee = np.eye(4)
    ee[:3, 3] = (0.02, -0.01, 0.1)
    q, step = np.array(Q_START) + 0.1, 1e-6

    def pose(at: np.ndarray) -> np.ndarray:
        out = np.zeros(16)
        library.O_T_J9(*(a.ctypes.data_as(ctypes.c_void_p) for a in (at, ee.T.copy(), out)))
        return out.reshape(4, 4).T

    jacobian = np.zeros(42)
    library.O_J_J9(*(a.ctypes.data_as(ctypes.c_void_p) for a in (q, ee.T.copy(), jacobian)))
    for joint, column in enumerate(jacobian.reshape(7, 6)):
        moved = [pose(q + sign * step * np.eye(7)[joint]) for sign in (1.0, -1.0)]
        assert np.allclose((moved[0] - moved[1])[:3, 3] / (2.0 * step), column[:3], atol=1e-6)
