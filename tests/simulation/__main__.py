"""Run chosen seeds again: ``PYTHONPATH=tests python -m simulation SEED [END]``.

One seed prints the last steps of the dispatcher before it broke; a range prints how fast it went.
"""

from __future__ import annotations

import sys
import time

from simulation.world import World


def main(first: int, end: int) -> int:
    """Run the seeds from ``first`` up to ``end``; return how many broke."""
    began_s, broken = time.process_time(), 0
    for seed in range(first, end):
        world = World(seed)
        try:
            world.run()
        except Exception as fault:  # noqa: BLE001 - an assertion anywhere is a finding
            broken += 1
            _tell(seed, world, fault)
    runs_hz = (end - first) / max(time.process_time() - began_s, 1e-9)
    sys.stdout.write(f"{end - first} runs, {broken} broken, {runs_hz:.0f} runs per CPU second\n")
    return broken


def _tell(seed: int, world: World, fault: Exception) -> None:
    for number, now_s, event, out in list(world.dispatcher.story)[-20:]:
        effects = ", ".join(type(instruction).__name__ for instruction in out)
        sys.stdout.write(f"{number:5d} {now_s:8.3f} s  {event}\n{'':18}-> {effects}\n")
    sys.stdout.write(f"seed {seed}: {type(fault).__name__}: {fault}\n")


if __name__ == "__main__":
    chosen = [int(argument) for argument in sys.argv[1:]]
    sys.exit(main(chosen[0], chosen[1] if len(chosen) > 1 else chosen[0] + 1) > 0)
