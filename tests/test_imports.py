"""The import rule of the architecture: arrows run one way, and the pure parts stay pure."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PARTS = {
    "protocol": "protocol/shearline/protocol",
    "record": "protocol/shearline/record",
    "sims": "sims/shearline/sims",
    "learner": "learner/shearline/learner",
    "studies": "learner/shearline/studies",
    "evaluator": "evaluator/shearline/evaluator",
    "deploy": "deploy/shearline/deploy",
}
MAY_IMPORT = {
    "protocol": set(),
    "record": {"protocol"},
    "sims": {"protocol"},
    "learner": {"protocol"},
    "studies": {"protocol", "learner"},
    "evaluator": {"protocol", "sims"},
    "deploy": set(PARTS) - {"deploy"},
}


def imported(path: Path) -> Iterator[str]:
    """Yield every module a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively: write the whole name"
            if node.module == "shearline":
                yield from (f"shearline.{alias.name}" for alias in node.names)
            elif node.module:
                yield node.module


def files(part: str) -> list[Path]:
    return sorted((ROOT / PARTS[part]).rglob("*.py"))


@pytest.mark.parametrize("part", PARTS)
def test_a_part_imports_only_the_parts_below_it(part: str) -> None:
    allowed = MAY_IMPORT[part] | {part}
    wrong = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files(part)
        for name in imported(path)
        if name.startswith("shearline.") and name.split(".")[1] not in allowed
    ]
    assert files(part), f"no files found for {part}"
    assert not wrong


def test_the_dispatcher_knows_neither_zenoh_nor_clock_nor_chance() -> None:
    pure = [path for path in files("learner") if "dispatch" in str(path.relative_to(ROOT))]
    assert pure
    for path in pure:
        assert not {"zenoh", "time", "random", "secrets", "threading"} & set(imported(path)), path


def test_no_namespace_root_has_an_init_file() -> None:
    assert not list(ROOT.glob("*/shearline/__init__.py"))


def test_every_part_says_that_it_is_typed() -> None:
    for folder in PARTS.values():
        assert (ROOT / folder / "py.typed").exists(), folder


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        ("shearline.protocol", {"zenoh", "sklearn", "mujoco", "rerun"}),
        ("shearline.learner", {"zenoh", "sklearn", "mujoco", "scipy"}),
        ("shearline.evaluator", {"zenoh", "sklearn", "mujoco", "numba"}),
        ("shearline.deploy.cli", {"zenoh", "sklearn", "mujoco", "numba", "rerun", "rich", "mcap"}),
    ],
)
def test_what_is_heavy_is_imported_only_when_it_is_used(module: str, heavy: set[str]) -> None:
    code = f"import sys, {module}; print(*sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not done.stdout.strip()
