"""Attacks take real processes in real time: they are run by `make attack`, not with the fast tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.attack.stand import Stand, running_service


@pytest.fixture
def stand(tmp_path: Path) -> Iterator[Stand]:
    """A service with 1024 descriptors."""
    with running_service(tmp_path) as running:
        yield running
