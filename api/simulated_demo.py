"""The demo's payload sessions: one plan, driven with each payload on the simulated arm that comes with the product."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import config
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession

RIG = "rx130l-joint3-simulated"
PAYLOADS = ("none", "disk-3.5", "disk-7")
"""0, 3.4584 and 6.970 kg: those of section IV of the paper"""
PLAN = Path(config.__file__).parent / "plans" / "rx130l-joint3-load-velocity.json"
"""made by `coulomb plan rx130l-joint3-simulated --model load-velocity --seconds 66`"""
_LOOK = 0.1
"""s between two looks at how far a session is"""


@dataclass(frozen=True)
class DemoSession:
    """A session of the demo. mass: kg, of the payload; words: how it ended."""

    file: str
    payload: str
    mass: float
    words: str


def fresh_folder(experiments: Path) -> Path:
    """`demo`, `demo-2`, …: a demo never touches what is there."""
    number = 1
    while (folder := experiments / ("demo" if number == 1 else f"demo-{number}")).exists():
        number += 1
    return folder


def record(
    rig: Rig,
    folder: Path,
    plan: ExcitationPlan,
    payload: str,
    operator: str = "demo",
    progress: Callable[[float], None] = lambda fraction: None,
    *,
    provisional: bool = False,
) -> DemoSession:
    """One session over CAN into an experiment's folder; what is to be told of it.

    progress    : called with the fraction of the plan that was driven, 0 to 1; raising from it stops and closes the session
    provisional : whether the experiment is still being put together, see `PayloadSession`

    Raises RuntimeError where the rig is not ready, or the session did not come to its end.
    """
    known = rig.payload(payload)
    with PayloadSession(rig, folder, plan, known, operator, provisional=provisional) as session:
        check = session.check()
        if not check.ok:
            raise RuntimeError(f"the simulated rig is not ready: {check.problems}")
        session.confirm_payload(known.mass)
        session.arm()
        session.start()
        while not session.wait(_LOOK).ended:
            progress(session.progress.fraction)
        if session.state is not SessionState.DONE or session.file is None:
            raise RuntimeError(
                f"the session with payload {payload} ended as {session.state.value}: {session.reason}"
            )
    return DemoSession(session.file.name, payload, known.mass, session.reason)
