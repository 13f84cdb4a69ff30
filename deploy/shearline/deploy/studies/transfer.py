"""Transfer: what was learned on one plant and task, tried on every other.

The experiments are those of the tables; only the recommended tuple travels.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from shearline.deploy.studies.contenders import Contender
from shearline.deploy.studies.dataset import FRESH_SEED, Gathering, Size, Wanted, folder_of, planned
from shearline.deploy.studies.trials_of import ran
from shearline.protocol.messages import Purpose
from shearline.studies.experiment import Experiment, Outcomes
from shearline.studies.section5 import Table
from shearline.studies.tabular import percent, seconds

#: Everywhere in a study, a place is a plant and a task.
Place = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Travelled:
    """One recommended tuple, tried in one place.

    Attributes:
        learned: Plant and task it was learned on.
        tried: Plant and task it was tried on.
        seed: Of the experiment.
        outcomes: Fresh trials there.
    """

    learned: Place
    tried: Place
    seed: int
    outcomes: Outcomes


def transfer(
    gathering: Gathering, who: Contender, places: Sequence[Place], seeds: range, size: Size
) -> list[Travelled]:
    """Learn in every place and try what is recommended in every place, running what is missing.

    Trials in one place have the same noise wherever a tuple comes from.

    Raises:
        RunFailed: If a run fails.
        KeyboardInterrupt: If it was interrupted; the same call goes on later.
    """
    found: dict[Place, list[Experiment]] = {}
    for plant, task in places:
        wanted = [Wanted(who, task, plant, seed, size) for seed in seeds]
        found[plant, task] = gathering.experiments(wanted)
    travelled = []
    for tried in places:
        plant, task = tried
        runs = []
        for learned, one in ((place, one) for place in places for one in found[place]):
            config = planned(task, [one.recommended] * size.fresh, 2 * FRESH_SEED + one.seed)
            name = f"{who.name}-{one.seed:02d}-from"
            runs.append(
                (learned, one.seed, folder_of(gathering.study, config, plant, name), config)
            )
        gathering.lead(plant, {folder: config for *_, folder, config in runs}.items())
        travelled += [
            Travelled(learned, tried, seed, ran(folder).outcomes(Purpose.LEARNING))
            for learned, seed, folder, _ in runs
        ]
    return travelled


def table(travelled: Sequence[Travelled]) -> Table:
    """Return a row for each place of learning, a column for each place of trying.

    Success in percent and mean cost of successes, with standard errors over experiments.
    """
    places = list(dict.fromkeys(one.tried for one in travelled))
    head = ["learned on", *(f"on {plant}, {task}" for plant, task in places)]
    cells: dict[tuple[Place, Place], list[Outcomes]] = {}
    for one in travelled:
        cells.setdefault((one.learned, one.tried), []).append(one.outcomes)
    rows = [
        [
            ", ".join(learned),
            *(
                f"{percent([o.rate for o in cells[learned, tried]])} %"
                f" at {seconds([o.won_cost for o in cells[learned, tried]])}"
                for tried in places
            ),
        ]
        for learned in places
    ]
    return head, rows


def places_of(plants: Sequence[str], tasks: Sequence[str]) -> list[Place]:
    """Return every plant with every task."""
    return list(itertools.product(plants, tasks))
