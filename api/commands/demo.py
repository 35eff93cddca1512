"""`coulomb demo`: the whole loop on the built-in simulated drive, over CAN."""

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import config

if TYPE_CHECKING:
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.rig import Rig
    from identify.results.identification import IdentificationDocument

_RIG = "rx130l-joint3-simulated"
_PAYLOADS = ("none", "disk-3.5", "disk-7")
"""0, 3.4584 and 6.970 kg: those of section IV of the paper"""
PLAN = Path(config.__file__).parent / "plans" / "rx130l-joint3-load-velocity.json"
"""made by `coulomb plan rx130l-joint3-simulated --model load-velocity --seconds 66`"""


@dataclass(frozen=True)
class DemoSession:
    """A session of the demo. mass: kg, of the payload; words: how it ended."""

    file: str
    payload: str
    mass: float
    words: str


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("demo")(demo)


def demo(
    out: Annotated[
        Path | None,
        typer.Option(help="folder for the demo's data; left out, the service's own data folder is used"),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Three payload sessions on a simulated drive, identified after each, diagnosed, what is missing added."""
    from rich.console import Console

    from api.commands.run import identify_so_far, percent, print_errors
    from api.data_folder import default_data_folder
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.rig import Rig
    from daq.session_outcome import Recorded
    from identify.diagnosis.improvement import improve
    from identify.identification import identify
    from identify.recording import load_experiment

    began = time.monotonic()
    console = Console(stderr=as_json)

    def say(text: str = "") -> None:
        console.print(text, highlight=False, soft_wrap=True)

    rig = Rig.load(_RIG)
    data = out or default_data_folder()
    folder = _fresh_folder(data / "experiments")
    plan = ExcitationPlan.load(PLAN)
    moving = _seconds_of_motion(plan)
    say(f"Rig {rig.name}: {rig.description}.")
    say(
        f"Plan: made for the load-velocity model; {plan.duration:.0f} s, {moving:.0f} s of motion; "
        "each payload drives the same."
    )
    say()
    sessions: list[DemoSession] = []
    identifications: list[IdentificationDocument] = []
    for payload in _PAYLOADS:
        session = _record(rig, folder, plan, payload)
        sessions.append(session)
        say(f"Session with payload {payload}: {session.words}.")
        result = identify_so_far(Recorded(folder, folder / session.file, payload), "demo")
        identifications.append(result)
        print_errors(console, result, lambda line: say(f"  {line}"))
    say()
    experiment = load_experiment(folder)
    story = improve(experiment, "usual")
    document = story.document()
    say("What does the usual model (inertia, gravity, viscous and constant dry friction) miss?")
    for number, step in enumerate(document.steps):
        what = "usual model" if step.added is None else f"+ {step.added.effect}"
        say(f"  {number}. {what}: relative error {percent(step.relative_error)}")
    say(f"  Verdict: {document.verdict}.")
    say()
    best = identify(experiment, "load-velocity").document()
    usual = identifications[-1]
    say(
        f"The paper's load-velocity model, eq. (30): {percent(best.relative_error)} instead of "
        f"{percent(usual.relative_error)} with the usual one."
    )
    lasted = time.monotonic() - began
    say()
    say(f"{lasted:.0f} s for {3 * moving:.0f} s of motion. The data: {folder}")
    opening = "coulomb serve" if out is None else f"coulomb serve --data {data}"
    say(f"Look at it in a browser: {opening}")
    if as_json:
        print(
            json.dumps(
                {
                    "experiment": str(folder),
                    "sessions": [asdict(session) for session in sessions],
                    "identifications": [each.to_json() for each in identifications],
                    "improvement": document.to_json(),
                    "load_velocity": best.to_json(),
                    "seconds": lasted,
                },
                ensure_ascii=False,
            )
        )


def _fresh_folder(experiments: Path) -> Path:
    """`demo`, `demo-2`, …: a demo never touches what is there."""
    number = 1
    while (folder := experiments / ("demo" if number == 1 else f"demo-{number}")).exists():
        number += 1
    return folder


def _seconds_of_motion(plan: "ExcitationPlan") -> float:
    """s of the plan in which a joint moves."""
    import numpy as np

    times = np.arange(0.0, plan.duration, 0.01)
    return float(0.01 * np.count_nonzero(np.abs(plan.setpoints(times).velocity).max(axis=1) > 1e-6))


def _record(rig: "Rig", folder: Path, plan: "ExcitationPlan", payload: str) -> DemoSession:
    """One session over CAN; what is to be told of it."""
    from daq.session_events import SessionState
    from daq.session_workflow import PayloadSession

    known = rig.payload(payload)
    with PayloadSession(rig, folder, plan, known, "demo") as session:
        check = session.check()
        if not check.ok:
            raise RuntimeError(f"the simulated rig is not ready: {check.problems}")
        session.confirm_payload(known.mass)
        session.arm()
        session.start()
        if session.wait() is not SessionState.DONE or session.file is None:
            raise RuntimeError(
                f"the session with payload {payload} ended as {session.state.value}: {session.reason}"
            )
    return DemoSession(session.file.name, payload, known.mass, session.reason)
