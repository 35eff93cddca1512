"""`coulomb run`: one payload session from the terminal."""

import getpass
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.rig import Rig
    from daq.session_events import SessionEvent
    from daq.session_outcome import Recorded
    from daq.session_workflow import PayloadSession
    from identify.results.identification import IdentificationDocument


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("run")(run)


def run(
    rig: Annotated[str, typer.Argument(help="rig file, or the name of one in config/rigs")],
    payload: Annotated[str, typer.Option(help="name of the payload, as in the rig file")],
    plan: Annotated[Path | None, typer.Option(help="plan file; left out, a standard plan is made")] = None,
    seconds: Annotated[float, typer.Option(min=5, help="length of the standard plan")] = 60.0,
    experiment: Annotated[
        Path | None, typer.Option(help="folder of the experiment; made when it is not there")
    ] = None,
    mass: Annotated[
        float | None, typer.Option(min=0, help="kg, the payload as weighed; left out, it is asked for")
    ] = None,
    scale: Annotated[str | None, typer.Option(help="serial port of the weighing scale (MT-SICS)")] = None,
    validation: Annotated[bool, typer.Option("--validation", help="keep the session for validation")] = False,
    operator: Annotated[str | None, typer.Option(help="who does this; left out, the user's name")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="start without asking; simulated rigs only")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Run one payload session: check the rig, weigh and confirm the payload, arm, start, record, identify.

    Ctrl-C stops the motion.
    """
    from rich.console import Console

    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.excitation.standard_plan import standard_plan
    from daq.files_as_read import FilesAsRead, rig_as_read
    from daq.session_workflow import PayloadSession
    from identify.recording.errors import InputError

    settings, made_from = rig_as_read(rig)
    if yes and settings.simulated is None:
        raise InputError("--yes: is for simulated rigs; a real robot is started by a person who sees it")
    known = settings.payload(payload)
    if plan is not None:
        made_from |= FilesAsRead.of([plan])
    motion = standard_plan(settings, seconds) if plan is None else ExcitationPlan.load(plan)
    folder = experiment or Path("experiments") / settings.name
    console = Console(stderr=True)
    results: list[IdentificationDocument] = []
    user = operator or getpass.getuser()
    session = PayloadSession(
        settings,
        folder,
        motion,
        known,
        user,
        role="validation" if validation else "identification",
        on_event=lambda event: _sound(console, event),
        made_from=made_from,
        after_session=lambda recorded: results.append(identify_so_far(recorded, user)),
    )
    done = conduct(console, session, lambda: _weighed(console, session, mass, scale, yes), yes)
    if as_json:
        document = {
            "state": session.state.value,
            "reason": session.reason,
            "file": None if session.file is None else str(session.file),
            "identification": results[-1].to_json() if results else None,
        }
        print(json.dumps(document, ensure_ascii=False))
    elif results:
        print_errors(console, results[-1])
    if not done:
        raise typer.Exit(1)


def conduct(console: Any, session: "PayloadSession", weigh: Callable[[], float], yes: bool) -> bool:
    """Take a session through its steps with the person at the terminal; whether the plan was driven to its end.

    weigh : gives the payload's mass, kg
    yes   : start without asking
    Raises typer.Exit: a step failed, or the person did not start.
    """
    from daq.session_events import StepOutOfTurn

    with session:
        try:
            check = session.check()
            for item in check.items:
                mark = "[yellow]note[/]" if item.advice else "[green]ok[/]" if item.ok else "[red]no[/]"
                console.print(f"{mark} {item.what}: {item.words}", highlight=False)
            said = {item.words for item in check.items}
            for remark in (each for each in session.remarks if each not in said):
                console.print(f"[yellow]note[/] {remark}", highlight=False)
            if not check.ok:
                raise typer.Exit(1)
            session.confirm_payload(weigh())
            session.arm()
            _explain(console, session.rig, session.plan, session.payload.name)
            if not yes and not typer.confirm("Start? The robot will move", err=True):
                session.stop("the operator did not start")
                session.wait()
                raise typer.Exit(1)
            session.start()
            watch(console, session)
        except StepOutOfTurn as error:
            console.print(f"[red]{error}[/]", highlight=False)
            raise typer.Exit(1) from None
        except KeyboardInterrupt:
            # Before the motion: `watch` has its own.
            session.stop("the operator pressed Ctrl-C")
            session.wait()
    done = session.state.value == "done"
    console.print(
        f"[{'green' if done else 'red'}]{session.state.value}[/]: {session.reason}", highlight=False
    )
    return done


def _weighed(
    console: Any, session: "PayloadSession", mass: float | None, scale: str | None, yes: bool
) -> float:
    """kg: from the scale, from the option, or from the operator."""
    if scale is not None:
        from drivers.scale import Scale

        with Scale(scale) as instrument:
            weight = instrument.weigh()
        console.print(f"ok scale: {weight.mass:g} kg ({weight.text})", highlight=False)
        return weight.mass
    if mass is not None:
        return mass
    expected = session.payload.mass
    if yes:
        return expected
    return typer.prompt(
        f"Mount payload {session.payload.name!r} ({expected:g} kg). Mass as weighed, kg", type=float, err=True
    )


def _sound(console: Any, event: "SessionEvent") -> None:
    """What a person must do now, in red, whatever else is on the screen."""
    if event.kind == "alarm" and event.words:
        console.print(f"[bold white on red] {event.words} [/]", highlight=False)


def _explain(console: Any, rig: "Rig", plan: "ExcitationPlan", payload: str) -> None:
    console.print(
        f"Armed. Rig {rig.name}, payload {payload}: {plan.duration:.1f} s of motion of "
        f"{', '.join(plan.joints)}. Ctrl-C stops it at any time.",
        highlight=False,
    )


def watch(console: Any, session: "PayloadSession") -> None:
    """Progress bar and live figures until the session ends; Ctrl-C stops the motion and waits for rest."""
    from rich.console import Group
    from rich.live import Live
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
        console=console,
    )
    task = bar.add_task("recording", total=1.0)
    stopping = False
    with Live(console=console, transient=True, refresh_per_second=5) as screen:
        while not session.state.ended:
            try:
                session.wait(0.2)
                bar.update(task, completed=session.progress.fraction)
                screen.update(Group(bar, _figures(session)))
            except KeyboardInterrupt:
                if not stopping:
                    stopping = True
                    session.stop("the operator pressed Ctrl-C")


def _figures(session: "PayloadSession") -> Any:
    """A table of the newest sample of every axis, and what the last half second lost."""
    import numpy as np
    from rich.table import Table

    table = Table(box=None)
    for name in ("joint", "position", "following error", "current, A", "temperature, °C", "lost in 0.5 s"):
        table.add_column(name, justify="left" if name == "joint" else "right")
    live = session.live(0.5)
    if not len(live.time):
        return table
    for axis, settings in enumerate(session.rig.axes):
        error = live.setpoint[-1, axis] - live.position[-1, axis]
        temperature = live.temperature[-1, axis]
        table.add_row(
            settings.joint,
            f"{live.position[-1, axis]:+.4f}",
            f"{error:+.5f}",
            f"{live.command[-1, axis]:+.2f}",
            "" if np.isnan(temperature) else f"{temperature:.1f}",
            str(int(np.isnan(live.position[:, axis]).sum())),
        )
    return table


def identify_so_far(recorded: "Recorded", user: str) -> "IdentificationDocument":
    """Fit the current model (at first the usual one) to all sessions of the experiment so far.

    The fit becomes a part of the story of the experiment's models, as after a session of the service. Returns its document.
    """
    from api.service.computations import fit
    from api.service.model_story import ModelStory
    from api.service.refit import folder_apart, next_refit, store_refit

    story = ModelStory(recorded.experiment)
    refit = next_refit(story)
    with folder_apart(story, refit.version) as output:
        fitted = fit(lambda _done, _step: None, str(recorded.experiment), refit.model, refit.add, str(output))
        store_refit(story, fitted, user)
    return fitted.identification


def percent(error: float | None) -> str:
    """A relative error for a person."""
    return "–" if error is None else f"{100 * error:.2f} %"


def print_errors(
    console: Any, result: "IdentificationDocument", say: Callable[[str], None] | None = None
) -> None:
    """What the model makes of all sessions so far."""
    say = say or (lambda line: console.print(line, highlight=False))
    sessions = ", ".join(f"{each.payload} {percent(each.relative_error)}" for each in result.sessions)
    say(
        f"model {result.model} over {len(result.sessions)} sessions: relative error "
        f"{percent(result.relative_error)} ({sessions})"
    )
