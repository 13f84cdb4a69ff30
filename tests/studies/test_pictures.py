"""Pictures are drawn, hold what they should, and are the same for the same data."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from shearline.protocol.errors import ConfigError
from shearline.studies import curves_picture, peaks_picture
from shearline.studies.curves import Curve
from shearline.studies.peaks import GRID, Array, Panel
from shearline.studies.pictures import BLUE, VERMILION
from shearline.studies.repeat import Placement

BYTES_MAX = 200_000


def colours(path: Path) -> set[str]:
    with Image.open(path) as image:
        return {
            f"#{r:02X}{g:02X}{b:02X}"
            for r, g, b in np.unique(np.array(image.convert("RGB")).reshape(-1, 3), axis=0)
        }


def panel(episode: int, decision: Array) -> Panel:
    rng = np.random.default_rng(episode)
    good = rng.random(20) < 0.5
    return Panel(
        episode=episode,
        u=rng.random((20, 2)),
        fresh=np.ones(20, dtype=bool),
        good=good,
        decision=decision,
        means=np.array([[0.5, 0.5]]),
        covariances=np.array([np.diag([0.01, 0.02])]),
        best_cost=0.1,
    )


@pytest.mark.slow
def test_a_figure_3_shows_good_and_bad_whatever_the_filter_accepts(tmp_path: Path) -> None:
    axis = np.linspace(-1.0, 1.0, GRID)
    some = axis[:, None] + axis[None, :]
    panels = [panel(0, np.zeros_like(some)), panel(1, some), panel(2, -1.0 - some**2)]
    row = peaks_picture.Row("title", lambda u: np.sum(u**2, axis=-1), [(0.5, 0.5)], panels)
    for name in ("a.png", "b.png"):
        peaks_picture.draw([row], "caption", tmp_path / "new" / name)
    drawn = (tmp_path / "new" / "a.png").read_bytes()
    assert drawn == (tmp_path / "new" / "b.png").read_bytes()
    assert len(drawn) < BYTES_MAX
    assert {BLUE, VERMILION} <= colours(tmp_path / "new" / "a.png")


def curve(learner: str, placement: Placement, function: str = "sphere") -> Curve:
    return Curve(
        function=function,
        placement=placement,
        dimensions=5,
        learner=learner,
        runs=3,
        evaluations=[10, 20, 30],
        mean=[90.0, 1.0, 0.01],
        se=[1.0, 0.1, 0.001],
        episode_mean=[100.0],
        learner_s=0.1,
    )


@pytest.mark.slow
@pytest.mark.parametrize("function", ["sphere", "rastrigin"])
def test_a_figure_4_has_a_line_for_each_learner_known_or_not(function: str, tmp_path: Path) -> None:
    learners = ["psp", "hireps", "a-new-one"]
    found = [curve(name, place, function) for place in Placement for name in learners]
    path = tmp_path / "fig4.png"
    curves_picture.draw([*found, curve("ga", Placement.CENTRED, "another")], function, path)
    assert path.stat().st_size < BYTES_MAX
    assert {BLUE, VERMILION} <= colours(path)


def test_no_two_learners_differ_by_colour_alone_or_not_at_all() -> None:
    lines = [str(line) for line in curves_picture.LINES.values()]
    assert len(set(lines)) == len(lines)
    with_dashes = [(dashes, width) for _, dashes, width in curves_picture.LINES.values()]
    grey = [_luminance(colour) for colour, _, _ in curves_picture.LINES.values()]
    for i, one in enumerate(with_dashes):
        for j in range(i):
            assert str(one) != str(with_dashes[j]) or abs(grey[i] - grey[j]) > 0.08


def _luminance(colour: str) -> float:
    r, g, b = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def test_without_matplotlib_one_sentence_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ConfigError, match=r"shearline\[plots\]"):
        curves_picture.draw([curve("psp", Placement.CENTRED)], "sphere", tmp_path / "x.png")
