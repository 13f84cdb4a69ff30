"""How much is on record, by topic, told from the parts' own summaries without reading them."""

from __future__ import annotations

import struct
from collections import Counter
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader

from shearline.record.parts import is_live, parts


def tally(run_dir: Path) -> Counter[str] | None:
    """Return how many messages each topic has over all parts.

    Returns:
        ``None`` where a part has no end, or one that cannot be believed: only reading it tells.
    """
    found: Counter[str] = Counter()
    for path in parts(run_dir):
        if is_live(path):
            return None
        try:
            with path.open("rb") as file:
                summary = make_reader(file).get_summary()
        except (OSError, McapError, ValueError, struct.error):
            return None
        if summary is None or summary.statistics is None:
            return None
        for channel, count in summary.statistics.channel_message_counts.items():
            if channel not in summary.channels:
                return None
            found[summary.channels[channel].topic] += count
    return found
