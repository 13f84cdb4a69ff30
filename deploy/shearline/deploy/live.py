"""The live table on a terminal, plain lines elsewhere: where people look while a run goes on."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live

from shearline.deploy.table import episode_name, number, render
from shearline.protocol.messages import Status


class LiveShow:
    """Redraws the table at each status; on a pipe, prints one line per closed episode."""

    def __init__(self) -> None:
        self._console = Console()
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._episodes_said = 0

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        self._live.stop()

    def update(self, status: Status) -> None:
        """Draw the latest status."""
        if self._console.is_terminal:
            self._live.update(render(status), refresh=True)
            return
        for episode in status.history[self._episodes_said :]:
            self._console.print(
                f"{episode_name(episode, status.episodes)}:"
                f" {episode.success_rate:.0%} success, mean cost {number(episode.mean_cost)},"
                f" best {number(episode.best_cost)}"
            )
        self._episodes_said = max(self._episodes_said, len(status.history))

    def say(self, text: str) -> None:
        """Print one line above the table."""
        self._console.print(text, style="yellow", soft_wrap=True)
