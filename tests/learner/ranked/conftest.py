"""Fits are tried as they are used: on one thread, whatever else the machine is doing."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from shearline.learner.ranked.model import LIBRARIES
from shearline.learner.threads import fitting


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with fitting(*LIBRARIES):
        yield
