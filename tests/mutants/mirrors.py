"""Which tests mirror a module: those of its name, of what imports it, of the names of modules that import it, of its package."""

from __future__ import annotations

import ast
from functools import lru_cache
from pathlib import Path

ROOMS = ("api", "daq", "drivers", "identify")


def mirrors(module: Path, tests: Path) -> list[Path]:
    """Test files that a change of a module concerns, the nearest first.

    module : relative to the checkout's root, such as identify/estimation/fitting.py
    tests  : folder of all tests

    First the file of its name (`test_fitting.py`, with or without an `s`, or with its package's name before it:
    `test_node.py`), then the files in the room's tests that import it, then the files named after the modules
    that import it, then all others of the package's tests. Where there are none, the files that mention its name.
    """
    room = tests / module.parts[0]
    package = tests.joinpath(*module.parent.parts)
    files = sorted({*room.rglob("test_*.py"), *(tests / "api").rglob("test_*.py")})
    dotted = ".".join(module.with_suffix("").parts).removesuffix(".__init__")
    importing = [file for file in files if dotted in _imports(file)]
    near = [file for file in importing if file.is_relative_to(package)]
    of_users = [
        test
        for user in _sources(tests.parent)
        if dotted in _imports(user)
        for test in named_after(user.relative_to(tests.parent), tests)
    ]
    of_package = sorted({*package.rglob("test_*.py"), *room.glob(f"test_{module.parent.name}_*.py")})
    nearest = list(dict.fromkeys([*named_after(module, tests), *near, *importing, *of_users, *of_package]))
    return nearest or [file for file in files if module.stem in file.read_text(encoding="utf-8")]


@lru_cache(maxsize=1024)
def named_after(module: Path, tests: Path) -> tuple[Path, ...]:
    """Test files of the module's room that have its name."""
    stem = module.stem.rstrip("_")
    stems = (stem, f"{stem}s", stem.removesuffix("s"), f"{module.parent.name}_{stem}")
    named = {f"test_{each}.py" for each in stems}
    return tuple(file for file in sorted((tests / module.parts[0]).rglob("test_*.py")) if file.name in named)


@lru_cache(maxsize=1)
def _sources(root: Path) -> tuple[Path, ...]:
    """All modules of the four rooms."""
    return tuple(file for room in ROOMS for file in sorted((root / room).rglob("*.py")))


@lru_cache(maxsize=2048)
def _imports(file: Path) -> frozenset[str]:
    """Names of the modules that a file imports; of a relative import its name from the root."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            found.update(f"{node.module}.{name.name}" for name in node.names)
        elif isinstance(node, ast.Import):
            found.update(name.name for name in node.names)
    return frozenset(found)
