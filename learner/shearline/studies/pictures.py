"""What the studies' pictures share: colours that everyone can tell apart, type, and saving.

Matplotlib is loaded by the pictures themselves, when one is drawn.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from shearline.protocol.errors import ConfigError

#: Okabe and Ito's colours, safe for the common kinds of colour blindness
#: (https://jfly.uni-koeln.de/color/).
BLUE, ORANGE, GREEN = "#0072B2", "#E69F00", "#009E73"
VERMILION, PURPLE, SKY = "#D55E00", "#CC79A7", "#56B4E9"
INK, GREY, PALE = "#222222", "#8A8A8A", "#E9EDF2"

#: In a picture's palette: a dozen of ours and what lies between them at the edges of lines.
COLOURS = 128

STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "figure.dpi": 110,
    "savefig.dpi": 110,
}


def canvas() -> Any:
    """Return matplotlib's figure class, which needs no display.

    Raises:
        ConfigError: If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - heavy, and an extra
    except ModuleNotFoundError:
        raise ConfigError(
            "pictures need matplotlib: pip install 'shearline[plots]', or leave them (--no-picture)"
        ) from None
    return Figure


def style() -> Any:
    """Return a context in which matplotlib draws as our pages look."""
    import matplotlib as mpl  # noqa: PLC0415 - heavy, and an extra

    return mpl.rc_context(STYLE)


def save(figure: Any, path: Path) -> None:
    """Write a figure; the same figure gives the same bytes.

    Args:
        figure: What to write.
        path: The file; a ``.png`` is written with a palette, at a third of the size.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix != ".png":
        figure.savefig(path)
        return
    from PIL import Image  # noqa: PLC0415 - matplotlib brings it along

    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
