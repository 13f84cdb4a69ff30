"""A run folder: what is in it, who holds it, and whether a run may begin or go on there."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Self

from shearline.learner.dispatcher.book import Book
from shearline.learner.dispatcher.entries import RunOpened
from shearline.learner.run.config import RunConfig, difference, from_toml, to_toml
from shearline.learner.run.journal import Journal
from shearline.learner.run.summary import RunSummary, to_json, write
from shearline.protocol.errors import ConfigError, RecordError

JOURNAL = "journal"
CONFIG = "run.toml"
SUMMARY = "summary.json"

#: A log is kept in two files of this size at most.
LOG_BYTES_MAX = 10_000_000

_log = logging.getLogger("shearline.learner")


class Folder:
    """One run's folder, held until closed.

    Args:
        path: Made if missing.
        config: The run that is meant.
        resume: Insist on there being something to resume.

    Attributes:
        book: What its journal leads to; empty for a new run.

    Raises:
        ConfigError: If it holds a finished or another run, or nothing to resume.
        RecordError: If it cannot be used, or another learner holds it.
    """

    def __init__(self, path: Path, config: RunConfig, *, resume: bool = False) -> None:
        self.path = path
        if resume and not (path / JOURNAL).exists():
            raise ConfigError(f"there is no run to resume in {path}: correct it, or leave --resume")
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise RecordError(f"cannot make {path}: {fault.strerror}: choose another") from None
        self.journal = Journal(path / JOURNAL, durable=config.durable)
        try:
            self.book = Book.of(self.journal.entries)
            self._open(config)
        except BaseException:
            self.journal.close()
            raise

    def _open(self, config: RunConfig) -> None:
        opened = self.book.opened
        if opened is None:
            if self.journal.entries:
                raise RecordError(f"the journal in {self.path} has lost its head: start afresh")
            text = to_toml(config)
            write(self.path / CONFIG, text)
            entry = RunOpened(at_s=time.time(), run=self.path.resolve().name, config=text)
            self.journal.append([entry], sync=True)
            self.book.apply(entry)
            return
        if self.book.ended is not None:
            raise ConfigError(f"the run in {self.path} has ended: choose another folder")
        other = difference(config, from_toml(opened.config))
        if other:
            raise ConfigError(
                f"{self.path} holds another run, {other}:"
                " choose another folder, or ask for the same run to resume it"
            )

    def damage(self) -> str:
        """Say what was cut off the journal's end, or nothing."""
        torn = self.journal.torn_bytes
        return f"cut {torn} damaged bytes off the end of {self.journal.path}" if torn else ""

    def finish(self, summary: RunSummary) -> None:
        """Write the summary.

        Raises:
            RecordError: If it cannot be written.
        """
        write(self.path / SUMMARY, to_json(summary) + "\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.journal.close()


@contextmanager
def logged_to(path: Path) -> Iterator[None]:
    """Have what the learner says written to a file, which may fail without failing the run."""
    try:
        handler = RotatingFileHandler(path, maxBytes=LOG_BYTES_MAX, backupCount=1)
    except OSError as fault:
        raise RecordError(f"cannot write {path}: {fault.strerror}: make room there") from None
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    handler.handleError = lambda record: None  # type: ignore[method-assign]  # noqa: ARG005
    level = _log.level
    _log.addHandler(handler)
    _log.setLevel(logging.INFO)
    try:
        yield
    finally:
        _log.setLevel(level)
        _log.removeHandler(handler)
        handler.close()
