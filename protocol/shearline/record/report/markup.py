"""HTML and SVG elements as strings: one function that escapes, nothing that remembers.

Knows no page and no picture. A plain string is text and is escaped; :class:`Markup` is not.
"""

from __future__ import annotations

import html
from collections.abc import Iterable
from typing import TypeAlias

#: Elements that have no end tag.
VOID = frozenset({"br", "col", "input", "link", "meta"})


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


Child: TypeAlias = str | None
Value: TypeAlias = str | float | bool | None


def tag(name: str, /, *children: Child, **attributes: Value) -> Markup:
    """Return one element.

    Args:
        name: Of the element.
        *children: Markup or text; ``None`` is nothing.
        **attributes: ``class_`` stands for ``class`` and ``_`` for ``-``; ``True`` is an
            attribute without a value, ``None`` and ``False`` are no attribute.
    """
    head = "".join([name, *(_attribute(key, value) for key, value in attributes.items())])
    if name in VOID:
        return Markup(f"<{head}>")
    return Markup(f"<{head}>{join(children)}</{name}>")


def join(children: Iterable[Child]) -> Markup:
    """Return children side by side, text escaped."""
    return Markup("".join(_escaped(child) for child in children if child is not None))


def _attribute(key: str, value: Value) -> str:
    if value is None or value is False:
        return ""
    name = key.rstrip("_").replace("_", "-")
    if value is True:
        return f" {name}"
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return f' {name}="{html.escape(text)}"'


def _escaped(child: str) -> str:
    return child if isinstance(child, Markup) else html.escape(child, quote=False)
