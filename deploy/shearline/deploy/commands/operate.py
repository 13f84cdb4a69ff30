"""``shearline status | hold | resume | stop``: look at a running run, and steer it."""

from __future__ import annotations

import argparse
import time

from shearline.deploy.exits import Exit
from shearline.deploy.options import Subparsers, add_connect, add_json, seconds

#: Command, state it leads to, what it does.
COMMANDS = {
    "hold": ("held", "hand out no new trials; what runs is finished"),
    "resume": ("running", "go on handing out trials"),
    "stop": ("ended", "end the run now; what was counted stays counted"),
}


def register(commands: Subparsers) -> None:
    """Add the commands."""
    status = commands.add_parser("status", help="a running run at a glance")
    add_connect(status)
    add_json(status)
    status.set_defaults(handler=show_status)
    for name, (_, text) in COMMANDS.items():
        command = commands.add_parser(name, help=text)
        add_connect(command)
        command.add_argument("--why", default="", help="reason, goes on record")
        command.add_argument(
            "--within", type=seconds, default=10.0, metavar="S", help="wait at most S seconds"
        )
        command.set_defaults(handler=steer, command=name)


def show_status(arguments: argparse.Namespace) -> int:
    """Print the run's status once."""
    import msgspec  # noqa: PLC0415 - with the network

    from shearline.deploy.observe import Observer  # noqa: PLC0415 - loads zenoh

    with Observer.attach(arguments.connect, timeout_s=arguments.patience) as observer:
        status = observer.status()
    if arguments.json:
        print(msgspec.json.encode(status).decode())
        return Exit.OK
    from rich.console import Console  # noqa: PLC0415 - for people only

    from shearline.deploy.table import render  # noqa: PLC0415

    Console().print(render(status))
    return Exit.OK


def steer(arguments: argparse.Namespace) -> int:
    """Send a command and wait until the run says that it follows."""
    from shearline.deploy.observe import Observer  # noqa: PLC0415 - loads zenoh
    from shearline.protocol.errors import LinkError  # noqa: PLC0415
    from shearline.protocol.messages import CommandKind  # noqa: PLC0415

    wanted = COMMANDS[arguments.command][0]
    until_s = time.monotonic() + arguments.within
    with Observer.attach(arguments.connect, timeout_s=arguments.patience) as observer:
        run = observer.keys.run
        while time.monotonic() < until_s:
            # Said again until it is seen to work: a put is never acknowledged.
            observer.command(CommandKind(arguments.command), arguments.why)
            if any(status.state in {wanted, "ended"} for status in observer.statuses(1.0)):
                print(f"run {run} is {wanted}")
                return Exit.OK
            if wanted == "ended" and not observer.is_learner_alive():
                print(f"run {run} has ended")
                return Exit.OK
    raise LinkError(
        f"run {run} did not {arguments.command} within {arguments.within:g} s:"
        " look at `shearline status`"
    )
