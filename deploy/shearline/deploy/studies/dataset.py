"""The runs behind the tables of the paper's section 5: which there are, and those that lack, run.

One data set serves every table: a run for each contender and seed, and a second one that tries
what came of the first on fresh noise. A run's folder is named by all that decides it, so that
another size or task is another run and nothing is taken for what it is not.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from shearline.deploy.studies.contenders import Contender
from shearline.deploy.studies.lanes import Effort, Lanes, is_complete
from shearline.deploy.studies.trials_of import outcomes, ran
from shearline.deploy.table import duration
from shearline.evaluator.builtin import builtin_spec
from shearline.learner.registry import EXTRAS, LEARNERS
from shearline.learner.run.config import RunConfig, to_toml
from shearline.learner.run.folder import CONFIG, SUMMARY
from shearline.protocol.messages import Purpose
from shearline.studies.experiment import SPREADS, Experiment, draws_around
from shearline.studies.provenance import code_of

#: Seeds of the runs that try what came of others: no run that learns has one of them.
FRESH_SEED = 1_000_000
#: Digits of the digest in a folder's name.
DIGITS = 8
#: The file that says which code of a learner made a run.
CODE = "code"


@dataclass(frozen=True, slots=True)
class Size:
    """How large an experiment is; the paper's unless said otherwise.

    Attributes:
        episodes: Updates of the learner.
        trials: Of each episode.
        fresh: Trials of the recommended and of the cheapest tuple.
        around: Draws of each spread around the recommended tuple.
    """

    episodes: int = 10
    trials: int = 20
    fresh: int = 100
    around: int = 25


@dataclass(frozen=True, slots=True)
class Wanted:
    """One experiment that a study asks for."""

    contender: Contender
    task: str
    plant: str
    seed: int
    size: Size

    def learning(self) -> RunConfig:
        """Return the run that learns, and then tries what is recommended."""
        task = builtin_spec(self.task)
        plain = RunConfig(task=task)
        total = self.size.episodes * self.size.trials
        return RunConfig(
            task=task,
            learner=self.contender.learner,
            switches=dict(self.contender.switches(plain.space, total)),
            episodes=self.size.episodes,
            trials=self.size.trials,
            seed=self.seed,
            confirm=self.size.fresh,
            speculative=False,
        )

    def trying(self, found: Experiment) -> RunConfig:
        """Return the run that tries draws around the recommendation, and the cheapest tuple."""
        plain = RunConfig(task=builtin_spec(self.task))
        around = draws_around(plain.space, found.recommended, self.size.around, self.seed)
        again = [found.cheapest] * self.size.fresh if found.cheapest else []
        tuples = [*(one.tolist() for one in around), *again]
        return planned(self.task, tuples, FRESH_SEED + self.seed)

    def folder(self, study: Path, config: RunConfig, what: str = "") -> Path:
        """Return where a run of this experiment is kept."""
        return folder_of(study, config, self.plant, f"{self.contender.name}-{self.seed:02d}{what}")


def planned(task: str, tuples: Sequence[Sequence[float]], seed: int) -> RunConfig:
    """Return a run that tries the given tuples, each once and on noise of its own."""
    return RunConfig(
        task=builtin_spec(task),
        learner="plan",
        switches={"tuples": [list(one) for one in tuples]},
        episodes=1,
        trials=len(tuples),
        seed=seed,
        speculative=False,
    )


def folder_of(study: Path, config: RunConfig, plant: str, name: str) -> Path:
    """Return the folder of a run: its task and plant, its name, and a digest of all of it."""
    text = f"{plant}\n{to_toml(config)}"
    digest = hashlib.sha256(text.encode()).hexdigest()[:DIGITS]
    return study / "runs" / f"{config.task.name}-{plant}" / f"{name}-{digest}"


@dataclass(slots=True)
class Gathering:
    """Runs what a study lacks, and says how far it is.

    Attributes:
        study: The study's folder.
        workers: Runs led at once.
        quiet: Whether to keep progress to itself.
        record: Whether runs write a record beside their journal, without traces.
        renew: Run again what was made by other code of the same learner.
        efforts: What every stretch of running took, so far.
    """

    study: Path
    workers: int
    quiet: bool = False
    record: bool = False
    renew: bool = False
    efforts: list[tuple[Effort, float]] = field(default_factory=list)

    def lead(self, plant: str, runs: Iterable[tuple[Path, RunConfig]]) -> None:
        """Lead those of these runs that are not complete.

        Raises:
            RunFailed: If one fails.
            RecordError: If a folder cannot be used.
            KeyboardInterrupt: If it was interrupted; the same call goes on later.
        """
        missing = [(folder, config) for folder, config in runs if not is_complete(folder)]
        if not missing:
            return
        for folder, config in missing:
            _write_down(folder, msgspec.structs.replace(config, record=self.record))
        folders = [folder for folder, _ in missing]
        tell = _Progress(len(folders), quiet=self.quiet)
        effort = Lanes(self.study, folders, self.workers, plant, tell.done).run()
        self.efforts.append((effort, sum(ran(folder).trials_s for folder in folders)))

    def experiments(self, wanted: Sequence[Wanted], *, tried: bool = False) -> list[Experiment]:
        """Return the experiments, running what is missing.

        Args:
            wanted: In the order in which they are run, all on one plant.
            tried: Whether the cheapest tuple and draws around the recommendation are tried too.

        Raises:
            RunFailed: If a run fails.
            RecordError: If a folder cannot be used.
            KeyboardInterrupt: If it was interrupted; the same call goes on later.
        """
        plant = wanted[0].plant
        learning = [(one.folder(self.study, c := one.learning()), c) for one in wanted]
        _heed_code([folder for folder, _ in learning], wanted, renew=self.renew)
        self.lead(plant, learning)
        found = [_learned(one, folder) for one, (folder, _) in zip(wanted, learning, strict=True)]
        if not tried:
            return found
        trying = [
            (one.folder(self.study, c := one.trying(learned), "-tried"), c)
            for one, learned in zip(wanted, found, strict=True)
        ]
        self.lead(plant, trying)
        return [
            _tried(learned, folder, one.size)
            for one, learned, (folder, _) in zip(wanted, found, trying, strict=True)
        ]


def _write_down(folder: Path, config: RunConfig) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / CONFIG).write_text(to_toml(config))
    if config.learner in {*LEARNERS, *EXTRAS} and not (folder / CODE).exists():
        (folder / CODE).write_text(code_of(config.learner))


def _heed_code(folders: Sequence[Path], wanted: Sequence[Wanted], *, renew: bool) -> None:
    """Say which complete runs were made by other code of their learner, or remove them."""
    learners = {one.contender.learner for one in wanted} & {*LEARNERS, *EXTRAS}
    code = {learner: code_of(learner) for learner in learners}
    old = [
        (one.contender.name, folder)
        for one, folder in zip(wanted, folders, strict=True)
        if (folder / CODE).exists() and (folder / CODE).read_text() != code[one.contender.learner]
    ]
    for _, folder in old if renew else []:
        shutil.rmtree(folder)
    if old and not renew:
        names = ", ".join(dict.fromkeys(name for name, _ in old))
        print(
            f"shearline: {len(old)} runs ({names}) were made by other code of their learners than"
            " this: --renew runs them again",
            file=sys.stderr,
            flush=True,
        )


def _learned(one: Wanted, folder: Path) -> Experiment:
    """Read what a complete run came to."""
    summary, trials = json.loads((folder / SUMMARY).read_text()), ran(folder)
    advice = summary["recommendation"]
    return Experiment(
        contender=one.contender.name,
        task=one.task,
        plant=one.plant,
        seed=one.seed,
        episodes=one.size.episodes,
        learned=trials.outcomes(Purpose.LEARNING),
        recommended=list(advice["theta"].values()),
        claimed=advice["success_probability"],
        claimed_low=advice["interval"][0],
        cheapest=trials.cheapest(),
        fresh=trials.outcomes(Purpose.CONFIRMATION),
        engines=trials.engines,
        trials_s=trials.trials_s,
        wall_s=summary["wall_s"],
    )


def _tried(found: Experiment, folder: Path, size: Size) -> Experiment:
    """Add what was tried around a recommendation, and of the cheapest tuple."""
    trials = ran(folder)
    kinds: list[list[int]] = [[] for _ in SPREADS]
    again: list[int] = []
    for place, row in enumerate(trials.rows):
        kind = row.number // size.around
        (kinds[kind] if kind < len(SPREADS) else again).append(place)
    return msgspec.structs.replace(
        found,
        around=[outcomes(trials.rows[place] for place in places) for places in kinds],
        again=outcomes(trials.rows[place] for place in again),
        engines=sorted({*found.engines, *trials.engines}),
        trials_s=found.trials_s + trials.trials_s,
    )


@dataclass(slots=True)
class _Progress:
    """A line for every run that is complete."""

    total: int
    quiet: bool
    _began_s: float = field(default_factory=time.monotonic)
    _done: int = 0

    def done(self, folder: Path) -> None:
        """Say what a run came to, how many are left and for how long."""
        self._done += 1
        if self.quiet:
            return
        summary = json.loads((folder / SUMMARY).read_text())
        rates = " ".join(f"{100 * e['success_rate']:3.0f}" for e in summary["episodes"])
        each_s = (time.monotonic() - self._began_s) / self._done
        left = duration(each_s * (self.total - self._done))
        print(
            f"{self._done}/{self.total} {folder.parent.name} {folder.name}:"
            f" {rates} %{_fresh(summary)}; {left} left",
            flush=True,
        )


def _fresh(summary: dict[str, object]) -> str:
    confirmed = summary["confirmation"]
    if not isinstance(confirmed, dict) or confirmed["mean_cost"] is None:
        return ""
    return f", recommended {100 * confirmed['success_rate']:.0f} % at {confirmed['mean_cost']:.2f}"
