"""Two documents that are to say the same."""

from __future__ import annotations

from typing import Any

import pytest

CLOSE = 1e-9


def assert_same(found: Any, expected: Any, where: str = "") -> None:
    """The same keys, texts and numbers; numbers to `CLOSE` of their size."""
    if isinstance(expected, dict):
        assert list(found) == list(expected), where
        for key in expected:
            assert_same(found[key], expected[key], f"{where}.{key}")
    elif isinstance(expected, list | tuple):
        assert len(found) == len(expected), where
        for index, (own, other) in enumerate(zip(found, expected, strict=True)):
            assert_same(own, other, f"{where}[{index}]")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=CLOSE, abs=1e-300), where
    else:
        assert found == expected, where
