"""What holds for all tests: which examples hypothesis draws, and who may have a second chance."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

ATTACKS = Path(__file__).parent / "attack"

# The same examples in every run, so that a red run is about the change and not about the dice. `make test-random` throws
# them; what it finds is kept as an @example of its test. Neither minds the clock: how long an example takes says
# how busy the machine is.
CLOCKLESS = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("fixed", CLOCKLESS, derandomize=True)
settings.register_profile("random", CLOCKLESS, derandomize=False, print_blob=True)


def pytest_addoption(parser: pytest.Parser) -> None:
    """`make attack` asks for the attacks, which take real processes in real time and minutes."""
    parser.addoption("--run-attacks", action="store_true", help="run tests/attack too")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let a test that is marked `second_chance(reason)` run once more where it fails; leave attacks out unless asked for.

    :raises pytest.UsageError: such a mark has no reason.
    """
    if not config.getoption("--run-attacks"):
        attacks = [item for item in items if item.path.parent == ATTACKS]
        config.hook.pytest_deselected(items=attacks)
        items[:] = [item for item in items if item not in attacks]
    for item in items:
        mark = item.get_closest_marker("second_chance")
        if mark is not None:
            if not mark.args or not str(mark.args[0]).strip():
                raise pytest.UsageError(f"{item.nodeid}: second_chance needs a reason")
            item.add_marker(pytest.mark.flaky(reruns=1))


def pytest_collection_finish() -> None:
    """Leave what was imported and collected out of the search for garbage: each whole search looked at all of it again."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say how many tests took a second chance, and which."""
    taken = [report.nodeid for report in terminalreporter.stats.get("rerun", [])]
    terminalreporter.write_line(f"second chances taken: {len(taken)}")
    for node in taken:
        terminalreporter.write_line(f"  {node}")
