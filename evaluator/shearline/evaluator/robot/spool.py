"""Results that the learner has not acknowledged: kept on disk until it has.

The arm's process puts a result here before anybody hears of it; the worker takes it away when the
learner's acknowledgement came. Whoever dies in between, the next worker of this robot finds the
result and delivers it, to the run that it belongs to and to no other; and under the name under
which it was measured, for a learner counts no result of an evaluator that had no such attempt.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import msgspec

from shearline.evaluator.robot.store import sync, write
from shearline.protocol.errors import ConfigError
from shearline.protocol.messages import Result


class Kept(msgspec.Struct, frozen=True, kw_only=True):
    """One result, and of which run."""

    run: str
    result: Result


class Spool:
    """A folder with one file for each result.

    Args:
        folder: Is made if missing.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._owner = folder / "evaluator"
        folder.mkdir(parents=True, exist_ok=True)

    def expect(self, name: str) -> None:
        """Check that an evaluator of this name may deliver what is here.

        Raises:
            ConfigError: If results are owed under another name.
        """
        owner = self._owner.read_text() if self._owner.exists() else name
        owed = sum(1 for _ in self._folder.glob("*.json"))
        if owed and owner != name:
            raise ConfigError(
                f"evaluator {owner!r} still owes {owed} results in {self._folder} and this one is"
                f" {name!r}: start it with --name {owner}, or delete them if their run is gone"
            )

    def own(self, name: str) -> None:
        """Keep results under this name from now on."""
        write(self._owner, name.encode())

    def put(self, run: str, result: Result) -> None:
        """Keep a result; once for each token, the first one stays."""
        path = self._path(result.token)
        if not path.exists():
            write(path, msgspec.json.encode(Kept(run=run, result=result)))

    def drop(self, token: str) -> None:
        """Forget a result: the learner has it, or never wants it."""
        path = self._path(token)
        if path.exists():
            path.unlink(missing_ok=True)
            sync(self._folder)

    def pending(self, run: str) -> list[Result]:
        """Return what a run has not acknowledged, oldest first; damaged files are left alone."""
        found = []
        for path in sorted(self._folder.glob("*.json"), key=lambda p: p.stat().st_mtime_ns):
            try:
                kept = msgspec.json.decode(path.read_bytes(), type=Kept)
            except (OSError, msgspec.MsgspecError):
                continue
            if kept.run == run:
                found.append(kept.result)
        return found

    def _path(self, token: str) -> Path:
        """Tokens come over the wire: they name no file."""
        return self._folder / f"{hashlib.sha256(token.encode()).hexdigest()[:32]}.json"
