"""Which tests mirror a module: those named after it, and those that import it."""

from __future__ import annotations

import ast
from functools import lru_cache
from pathlib import Path


def mirrors(module: Path, tests: Path) -> list[Path]:
    """Test files that a change of a module concerns, the nearest first; paths relative to the checkout's root.

    module : such as identify/estimation/fitting.py
    tests  : folder of all tests

    First the file of its name (`test_fitting.py`, with or without an `s`, or with its package's name before it:
    `test_simulated_node.py`), then the files in the room's tests that import it; where there are none, all files of
    the package's tests; where that has none, the files that mention its name.
    """
    room = tests / module.parts[0]
    package = tests.joinpath(*module.parent.parts)
    stems = (
        module.stem,
        f"{module.stem}s",
        module.stem.removesuffix("s"),
        f"{module.parent.name}_{module.stem}",
    )
    named = {f"test_{stem}.py" for stem in stems}
    files = sorted({*room.rglob("test_*.py"), *(tests / "api").rglob("test_*.py")})
    dotted = ".".join(module.with_suffix("").parts)
    own = [file for file in files if file.name in named and file.is_relative_to(room)]
    importing = [file for file in files if file not in own and dotted in _imports(file)]
    near = [file for file in importing if file.is_relative_to(package)]
    found = [*own, *near, *(file for file in importing if file not in near)]
    of_package = {*package.rglob("test_*.py"), *room.glob(f"test_{module.parent.name}_*.py")}
    found = list(dict.fromkeys(found)) or sorted(of_package)
    return found or [file for file in files if module.stem in file.read_text(encoding="utf-8")]


@lru_cache(maxsize=1024)
def _imports(file: Path) -> frozenset[str]:
    """Names of the modules that a file imports, also those named in a string (monkeypatch)."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found.update(f"{node.module}.{name.name}" for name in node.names)
        elif isinstance(node, ast.Import):
            found.update(name.name for name in node.names)
    return frozenset(found)
