"""Robots by name: one that comes with Shearline, or a class of the user's own.

Only what a person at this machine typed is ever imported.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from types import MappingProxyType

from shearline.evaluator.robot.port import RobotPort
from shearline.evaluator.tasks import import_code
from shearline.protocol.errors import ConfigError

#: Name to ``(module, class, what it needs)``.
BUILTIN: Mapping[str, tuple[str, str, str]] = MappingProxyType(
    {
        "franka": ("shearline.evaluator.robot.franky", "FrankyPort", "franky-control"),
        "panda": ("shearline.evaluator.robot.panda", "PandaPort", "panda-python"),
    }
)


def load_port(name: str, address: str = "") -> RobotPort:
    """Return a robot's port; nothing is connected yet.

    Args:
        name: ``"franka"``, ``"panda"`` or ``"module:Class"``, also ``"file.py:Class"``.
        address: Given to the class if not empty.

    Raises:
        ConfigError: If there is no such class, it is no port, or what it needs is not installed.
    """
    where, colon, called = name.partition(":")
    expected = f"{', '.join(BUILTIN)} or MODULE:CLASS for your own"
    if colon and where and called:
        module = import_code(where, expected)[0]
    elif name in BUILTIN:
        where, called, package = BUILTIN[name]
        try:
            module = importlib.import_module(where)
        except ModuleNotFoundError as missing:
            raise ConfigError(
                f"robot {name!r} needs {missing.name}: install {package} on this computer"
            ) from None
    else:
        raise ConfigError(f"no robot {name!r}: expected {expected}")
    made = getattr(module, called, None)
    if not isinstance(made, type):
        raise ConfigError(f"no class {called!r} in {where}: expected {expected}")
    try:
        port = made(address) if address else made()
    except TypeError as fault:
        raise ConfigError(f"{name} cannot be made: {fault}: see --address") from None
    if not isinstance(port, RobotPort):
        lacking = [m for m in _METHODS if not hasattr(port, m)]
        raise ConfigError(f"{name} is no robot port: it lacks {', '.join(lacking)}")
    return port


_METHODS = (
    "joints",
    "engine",
    "open",
    "sample",
    "set_guard",
    "move_free",
    "contact",
    "stop",
    "recover",
    "drain_log",
    "close",
)
