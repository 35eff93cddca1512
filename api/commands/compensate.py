"""`coulomb compensate`: a plan without and with the model's torque sent ahead, and what that did to the following error."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from api.command_arguments import Additions, AsJson, ModelName


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("compensate")(compensate)


def compensate(
    rig: Annotated[str, typer.Argument(help="rig file, or the name of one in config/rigs")],
    experiment: Annotated[
        str, typer.Option(help="of this robot: folder, experiment.yaml, or name of a stored one")
    ],
    payload: Annotated[str, typer.Option(help="name of the payload, as in the rig file")],
    plan: Annotated[Path | None, typer.Option(help="plan file; left out, a standard plan is made")] = None,
    seconds: Annotated[float, typer.Option(min=5, help="length of the standard plan")] = 20.0,
    model: ModelName = "load-velocity",
    add: Additions = None,
    part: Annotated[
        Literal["whole", "friction"],
        typer.Option(help="what of the model is sent: all of it, or what it has beside the rigid robot"),
    ] = "whole",
    share: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="of each axis's current limit: no more than that is sent")
    ] = 0.6,
    mass: Annotated[
        float | None, typer.Option(min=0, help="kg, the payload as weighed; left out, it is asked for")
    ] = None,
    operator: Annotated[str | None, typer.Option(help="who does this; left out, the user's name")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="start without asking; simulated rigs only")] = False,
    as_json: AsJson = False,
) -> None:
    """Drive a plan twice, without and with the model's torque sent ahead (0x60B2), and compare the following errors.

    Each drive of the plan waits for a start of its own. The torque is bounded, faded in and out, and the second drive is
    stopped when the following error grows beyond that of the first.
    """
    import getpass
    import sys
    from datetime import UTC, datetime

    from rich.console import Console

    from api.commands.run import conduct
    from api.compensation import torque_ahead
    from api.compensation_run import CompensationRun
    from api.compensation_text import compensation_text
    from api.proof import Proof, ProofSettings, next_folder
    from api.stored_experiments import resolve
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.excitation.standard_plan import standard_plan
    from daq.rig import Rig
    from identify.identification import identify
    from identify.recording import InputError, load_experiment

    settings = Rig.load(rig)
    if yes and settings.simulated is None:
        raise InputError("--yes: is for simulated rigs; a real robot is started by a person who sees it")
    known = settings.payload(payload)
    motion = standard_plan(settings, seconds) if plan is None else ExcitationPlan.load(plan)
    source = load_experiment(resolve(experiment))
    result = identify(source, model, add or [])
    ahead = torque_ahead(result, settings, motion, known, part, share)
    console = Console(stderr=True)
    for remark in ahead.remarks:
        console.print(f"Remark: {remark}", highlight=False)

    def weigh() -> float:
        if mass is not None:
            return mass
        if yes:
            return known.mass
        return typer.prompt(
            f"Mount payload {known.name!r} ({known.mass:g} kg). Mass as weighed, kg", type=float, err=True
        )

    asked = ProofSettings(
        experiment=source.name,
        rig=settings.name,
        plan=motion.name or "standard plan",
        payload=known,
        model=model,
        add=tuple(add or ()),
        part=part,
        share=share,
        operator=operator or getpass.getuser(),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    proof = Proof(next_folder(source.folder), asked, settings, motion, ahead)
    run = CompensationRun(proof)

    console.print("First without torque sent ahead.", highlight=False)
    try:
        driven = conduct(console, run.without(), weigh, yes)
    finally:
        run.forget_unless_driven()
    if not driven:
        raise typer.Exit(1)
    console.print(f"Now with it: {run.words()}", highlight=False)
    conduct(console, run.with_torque(), weigh, yes)
    document = run.document()
    print(document.json_text() if as_json else compensation_text(document))
    if not document.completed:
        print("the second drive of the plan did not come to its end", file=sys.stderr)
        raise typer.Exit(1)
