"""`coulomb compensate`: a plan without and with the model's feedforward torque, and what that did to the following error."""

import getpass
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from api.command_arguments import Additions, AsJson, ModelName

if TYPE_CHECKING:
    from api.proof import Proof
    from daq.rig import Rig
    from identify.recording import Experiment


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("compensate")(compensate)


def compensate(
    rig: Annotated[str, typer.Argument(help="rig file, or the name of one in config/rigs")],
    experiment: Annotated[
        str, typer.Option(help="of this robot: folder, experiment.yaml, or name of a stored one")
    ],
    payload: Annotated[
        str | None, typer.Option(help="name of the payload, as in the rig file; wanted for a new proof")
    ] = None,
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
    proof: Annotated[
        str | None,
        typer.Option(
            "--continue",
            help="number of a proof whose first run is recorded: only the second is driven, as was prepared then",
        ),
    ] = None,
    mass: Annotated[
        float | None, typer.Option(min=0, help="kg, the payload as weighed; left out, it is asked for")
    ] = None,
    operator: Annotated[str | None, typer.Option(help="who does this; left out, the user's name")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="start without asking; simulated rigs only")] = False,
    as_json: AsJson = False,
) -> None:
    """Drive a plan twice, without and with the model's feedforward torque (0x60B2), and compare the following errors.

    Each drive of the plan waits for a start of its own. The torque is bounded, faded in and out, and the second drive is
    stopped when the following error grows beyond that of the first. Where the second is not driven, the first is kept, and
    --continue drives the second at another time.
    """
    from rich.console import Console

    from api.commands.run import conduct
    from api.compensation_run import CompensationRun
    from api.compensation_text import compensation_text
    from api.stored_experiments import resolve
    from api.unfinished_run import unfinished_run
    from daq.files_as_read import FilesAsRead, rig_as_read
    from identify.recording import InputError, load_experiment

    settings, made_from = rig_as_read(rig)
    if plan is not None:
        made_from |= FilesAsRead.of([plan])
    if yes and settings.simulated is None:
        raise InputError("--yes: is for simulated rigs; a real robot is started by a person who sees it")
    source = load_experiment(resolve(experiment))
    console = Console(stderr=True)
    if proof is None:
        if payload is None:
            raise InputError("--payload: the name of a payload of the rig file is needed")
        who = operator or getpass.getuser()
        made = _new_proof(source, settings, plan, seconds, payload, model, add or [], part, share, who)
        run = CompensationRun(made, made_from=made_from)
        for remark in _to_be_gone_on_with(source):
            console.print(f"Remark: {remark}", highlight=False)
    else:
        made = _stored_proof(source, settings, proof, payload)
        if (unfinished := unfinished_run(made.folder)) is not None:
            console.print(f"Remark: {unfinished.words}", highlight=False)
        run = CompensationRun.continued(made, made_from=made_from)
    for remark in made.ahead.remarks:
        console.print(f"Remark: {remark}", highlight=False)

    def weigh() -> float:
        if mass is not None:
            return mass
        known = made.settings.payload
        if yes:
            return known.mass
        return typer.prompt(
            f"Mount payload {known.name!r} ({known.mass:g} kg). Mass as weighed, kg", type=float, err=True
        )

    if proof is None:
        console.print("First without feedforward torque.", highlight=False)
        try:
            driven = conduct(console, run.without(), weigh, yes)
        finally:
            run.forget_unless_driven()
        if not driven:
            raise typer.Exit(1)
    second = run.with_torque()
    console.print(f"Now with it: {run.words()}", highlight=False)
    try:
        conduct(console, second, weigh, yes)
    finally:
        if run.is_half:
            print(
                f"the second run was not driven: the pair is incomplete, and nothing is compared. The first is kept in"
                f" {made.folder}; to drive the second: coulomb compensate {rig} --experiment {experiment}"
                f" --continue {made.name}",
                file=sys.stderr,
            )
    document = run.document()
    print(document.json_text() if as_json else compensation_text(document))
    if not document.completed:
        print(
            f"the second run did not come to its end; it can be driven again with --continue {made.name}",
            file=sys.stderr,
        )
        raise typer.Exit(1)


def _new_proof(
    source: "Experiment",
    rig: "Rig",
    plan: Path | None,
    seconds: float,
    payload: str,
    model: str,
    add: list[str],
    part: Literal["whole", "friction"],
    share: float,
    operator: str,
) -> "Proof":
    """What is to be sent along which plan; nothing is written yet."""
    from datetime import UTC, datetime

    from api.compensation import torque_ahead
    from api.proof import Proof, ProofSettings, next_folder
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.excitation.standard_plan import standard_plan
    from daq.files_as_read import drive_digests
    from identify.identification import identify

    known = rig.payload(payload)
    motion = standard_plan(rig, seconds) if plan is None else ExcitationPlan.load(plan)
    identified = identify(source, model, add)
    ahead = torque_ahead(identified, rig, motion, known, part, share)
    asked = ProofSettings(
        experiment=source.name,
        rig=rig.name,
        plan=motion.name or "standard plan",
        payload=known,
        model=identified.model,
        add=tuple(add),
        part=part,
        share=share,
        operator=operator,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        drives=drive_digests(rig),
    )
    return Proof(next_folder(source.folder), asked, rig, motion, ahead)


def _to_be_gone_on_with(source: "Experiment") -> list[str]:
    """Earlier proofs of the experiment whose last run nobody wrote down the end of, and how each goes on."""
    from api.proof import proof_folders
    from api.unfinished_run import unfinished_run
    from identify.recording import InputError

    remarks: list[str] = []
    for folder in proof_folders(source.folder):
        try:
            run = unfinished_run(folder)
        except InputError:
            continue  # damaged, which is said where that proof is asked for
        if run is None:
            continue
        go_on = "This is another proof"
        if run.drive == "with":
            go_on = f"--continue {folder.name} drives it again"
        remarks.append(f"proof {folder.name}: {run.words} {go_on}.")
    return remarks


def _stored_proof(source: "Experiment", rig: "Rig", number: str, payload: str | None) -> "Proof":
    """A proof as it was prepared.

    Raises InputError: there is none of that number, or it is of another rig or payload.
    """
    from api.proof import Proof, proof_folders
    from identify.recording import InputError

    folders = {int(folder.name): folder for folder in proof_folders(source.folder)}
    folder = folders.get(int(number)) if number.isascii() and number.isdigit() else None
    if folder is None:
        kept = ", ".join(each.name for each in folders.values()) or "none"
        raise InputError(
            f"--continue {number}: experiment {source.name} has no proof of this number; it has: {kept}"
        )
    stored = Proof.load(folder, rig)
    if stored.settings.rig != rig.name:
        raise InputError(f"--continue {number}: the proof is of rig {stored.settings.rig}, not {rig.name}")
    if payload not in (None, stored.settings.payload.name):
        raise InputError(
            f"--continue {number}: the proof is with payload {stored.settings.payload.name}, not {payload}"
        )
    return stored
