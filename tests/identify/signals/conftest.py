"""Sessions made from closed forms."""

from pathlib import Path

import numpy as np
import pytest

from identify.recording import Experiment, Joint, Payload, Robot, Session, SessionEntry, SignalCutoffs


@pytest.fixture
def made_session():
    """A session of given positions and commands, (N,) or (N, n)."""

    def make(position, period, command=None, segments=None):
        table = np.reshape(position, (len(position), -1))
        entry = SessionEntry("made.csv", Path("made.csv"), Payload(name="none", mass=0.0), "identification")
        return Session(
            entry,
            time=period * np.arange(len(table)),
            position=table,
            command=table if command is None else np.reshape(command, (len(table), -1)),
            segments=segments or (slice(0, len(table)),),
            sampling_period=period,
        )

    return make


@pytest.fixture
def made_experiment():
    """An experiment of one joint without files."""

    def make(**cutoffs):
        joint = Joint(name="j1", type="revolute", drive_gain=1.0)
        return Experiment(
            name="made",
            path=Path("made/experiment.yaml"),
            robot=Robot(gravity=(0.0, 0.0, 0.0), joints=(joint,)),
            sessions=(),
            payloads=(),
            signals=SignalCutoffs(**cutoffs),
            effects=(),
        )

    return make
