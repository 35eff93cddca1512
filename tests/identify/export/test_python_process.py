"""An exported module in an interpreter of its own: what it is given, what comes back, and what is said where it fails."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.python_process import python_torque
from identify.export.record_error import Motion
from identify.recording import InputError, Payload

PAYLOAD = Payload(name="block", mass=2.0, com=(0.5, 0.0, 0.0))
"""its first moment is 1 kg m along x"""
OF_THE_INSTANT = """
MEMORIES = ()
print("said on the way out, and no answer")
def torque(q, dq, ddq, t, temperature, memory, payload):
    assert memory is None
    warm = 0.0 if temperature is None else temperature
    return q + 10 * dq + 100 * ddq + 1000 * t + warm + payload[6] * 1e4 + payload[9] * 1e5
"""
WITH_MEMORY = """
MEMORIES = ("play",)
def memory_at_start(dq):
    return (7.0 * dq,)
def memory_after(memory, before, after):
    return (memory[0] + 2.0 * (after - before),)
def torque(q, dq, ddq, t, temperature, memory, payload):
    return memory[0].T
"""
LATE = """
LATENCY = 2
MEMORIES = ()
def torque_along(q, dq, ddq, t, u, temperature, memory, payload):
    return 0.0 * q + q[:, -1:] + 1000 * q.shape[1]
"""


@pytest.fixture
def module(tmp_path):
    def written(text):
        file = tmp_path / "arm.py"
        file.write_text(text, encoding="utf-8")
        return python_torque(file)

    return written


def motion(rows=4, temperature=None):
    """Of two joints; each value says which it is."""
    random = np.random.default_rng(rows)
    q, dq, ddq = (random.uniform(-1, 1, (rows, 2)) for _ in range(3))
    return Motion(0.1 * np.arange(rows), q, dq, ddq, temperature, PAYLOAD)


def test_each_input_arrives_as_what_it_is_and_one_process_answers_motion_after_motion(module):
    with module(OF_THE_INSTANT) as torque_of:
        for rows in (4, 1, 7):
            for warm in (None, np.full((rows, 2), 0.125)):
                given = motion(rows, warm)
                expected = given.q + 10 * given.dq + 100 * given.ddq + 1000 * given.t[:, None] + 1e4 + 2e5
                expected += 0.0 if warm is None else warm
                assert torque_of(given) == pytest.approx(expected, rel=1e-12)


def test_a_memory_begins_with_the_first_row_and_is_carried_from_each_to_the_next(module):
    given = motion()
    with module(WITH_MEMORY) as torque_of:
        for _ in range(2):
            assert torque_of(given) == pytest.approx(7.0 * given.dq[0] + 2.0 * (given.q - given.q[0]))


def test_a_motion_goes_on_for_the_latency_and_its_own_rows_come_back(module):
    given = motion()
    last = given.q[-1] + 2.0 * (given.q[-1] - given.q[-2])
    with module(LATE) as torque_of:
        found = torque_of(given)
    assert found == pytest.approx(np.tile(last + 6000.0, (4, 1)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("MEMORIES = (", r"^arm\.py: Python does not take it: SyntaxError: '\(' was never closed$"),
        ("MEMORIES = ()\ndef torque(*given):\n    return 1 / 0\n", r"not take it: ZeroDivisionError: .*$"),
        ("import sys\nsys.exit(0)", r"^arm\.py: Python does not take it: $"),
    ],
)
def test_what_python_does_not_take_is_refused_by_the_last_line_that_it_says(module, text, words):
    with module(text) as torque_of, pytest.raises(InputError, match=words):
        torque_of(motion())
