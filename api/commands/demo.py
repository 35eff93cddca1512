"""`coulomb demo`: the whole loop on the built-in simulated drive, over CAN."""

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from daq.excitation.excitation_plan import ExcitationPlan
    from identify.results.identification import IdentificationDocument


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
    from api.simulated_demo import PAYLOADS, PLAN, RIG, DemoSession, fresh_folder, record
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

    rig = Rig.load(RIG)
    data = out or default_data_folder()
    folder = fresh_folder(data / "experiments")
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
    for payload in PAYLOADS:
        session = record(rig, folder, plan, payload)
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


def _seconds_of_motion(plan: "ExcitationPlan") -> float:
    """s of the plan in which a joint moves."""
    import numpy as np

    times = np.arange(0.0, plan.duration, 0.01)
    return float(0.01 * np.count_nonzero(np.abs(plan.setpoints(times).velocity).max(axis=1) > 1e-6))
