"""`coulomb plan`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from daq.excitation.plan_report import PlanReport


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("plan")(plan_command)


def plan_command(
    rig: Annotated[str, typer.Argument(help="name of a rig in config/rigs, or a rig file")],
    model: Annotated[
        str, typer.Option(help="rigid, usual, load-velocity, or rigid+effect,effect…")
    ] = "load-velocity",
    add: Annotated[list[str] | None, typer.Option(help="EFFECT or EFFECT@JOINT; may be repeated")] = None,
    seconds: Annotated[float, typer.Option(help="s, of each session, at most")] = 60.0,
    payload: Annotated[
        list[str] | None,
        typer.Option(help="name of a payload of the rig, one session each; all of them if not said"),
    ] = None,
    identified: Annotated[
        Path | None,
        typer.Option(help="what `coulomb identify --json` printed: loads and currents are predicted with it"),
    ] = None,
    noise: Annotated[
        float,
        typer.Option(
            help="standard deviation of the filtered torque, as a share of the torque at the current limit"
        ),
    ] = 0.01,
    criterion: Annotated[str, typer.Option(help="d-optimal or condition")] = "d-optimal",
    seed: Annotated[int, typer.Option(min=0, help="of the search; the same seed gives the same plan")] = 0,
    check: Annotated[Path | None, typer.Option(help="judge this plan file instead of making a plan")] = None,
    output: Annotated[Path | None, typer.Option(help="write the plan file here")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw position, speed and predicted current here (png, svg, pdf)")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Plan the motion of a payload session: what it will tell about a model, and what it cannot."""
    import sys

    import numpy as np

    from api.assumed_masses import torque_limits
    from api.plan_model import Identified, RegressorModel
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.excitation.optimal_excitation import CRITERIA, Request
    from daq.excitation.plan_picture import draw_plan
    from daq.excitation.plan_report import judge, make_plan
    from daq.excitation.standard_plan import LONGEST
    from daq.rig import Rig
    from identify.recording.errors import InputError

    if criterion not in CRITERIA:
        raise InputError(f"--criterion {criterion}: must be {' or '.join(CRITERIA)}")
    if not 0.0 < noise < 1.0:
        raise InputError(f"--noise {noise:g}: must be a share between 0 and 1")
    if not 1.0 < seconds <= LONGEST:
        raise InputError(f"--seconds {seconds:g}: must be between 1 and {LONGEST:g}")
    settings = Rig.load(rig)
    payloads = tuple(settings.payload(name) for name in payload) if payload else settings.payloads
    known = None if identified is None else Identified.load(identified)
    request = Request(
        rig=settings,
        model=RegressorModel(settings, model, payloads, add or [], known),
        payloads=payloads,
        seconds=seconds,
        noise=np.asarray(noise * torque_limits(settings)),
        criterion=criterion,
        seed=seed,
    )

    def progress(fraction: float, step: str) -> None:
        if sys.stderr.isatty():
            print(f"\r{step}: {fraction:4.0%}", end="\n" if fraction == 1.0 else "", file=sys.stderr)

    report = make_plan(request, progress) if check is None else judge(request, ExcitationPlan.load(check))
    if picture is not None:
        draw_plan(report.plan, report.request, picture)
    if output is not None:
        try:
            output.write_text(report.plan.to_json(), encoding="utf-8")
        except OSError as error:
            raise InputError(f"{output}: cannot be written ({error.strerror or error})") from None
    if as_json:
        print(report.document().json_text())
    else:
        print(_in_words(report))


def _in_words(report: "PlanReport") -> str:
    """The report as an operator reads it."""
    plan, request = report.plan, report.request
    condition = report.information.condition_number
    lines = [
        f"plan '{plan.name}' for rig {request.rig.name}, model {request.model.name}: {plan.duration:.1f} s",
        f"sessions: {', '.join(payload.name for payload in request.payloads)}",
        f"loads {request.model.source}",
    ]
    for begin, end, period in plan.repeated:
        repeats = round((end - begin) / period)
        lines.append(
            f"repeats exactly {repeats} times from {begin:.1f} s to {end:.1f} s, every {period:.2f} s"
        )
    lines.append(f"condition number {condition:.1f}" if condition else "condition number: none, see below")
    lines.append("")
    lines.append("standard deviations to expect:")
    for parameter, std in zip(request.model.parameters, report.information.deviations(), strict=True):
        figure = "not determined" if std is None else f"{std:10.3g} {parameter.unit}"
        if std is not None and parameter.value:
            figure += f"  ({100 * std / abs(parameter.value):.2g} % of {parameter.value:.4g})"
        lines.append(f"  {parameter.name:<18} {parameter.joint:<8} {figure}")
    for group in report.inseparable:
        how = "is not seen at all" if len(group) == 1 else "are seen only in combination"
        lines.append(f"  {', '.join(group)}: {how}")
    lines.append("")
    lines.append(
        "what the plan cannot show:" if report.hidden else "the plan shows every effect of the catalogue"
    )
    alike: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for hidden in report.hidden:
        alike.setdefault((hidden.reason, hidden.remedy, hidden.effects), []).append(hidden.joint)
    for (reason, remedy, effects), joints in alike.items():
        where = f"joint{'s' if len(joints) > 1 else ''} {', '.join(joints)}"
        lines.append(f"  {where}: {reason}: {', '.join(effects)} cannot be determined; {remedy}")
    lines.append("")
    lines.append("predicted peak current, A:")
    for p, payload in enumerate(request.payloads):
        peaks = ", ".join(
            f"{axis.joint} {report.peak_current[p, j]:.2f} of {axis.limits.current:g}"
            for j, axis in enumerate(request.rig.axes)
        )
        lines.append(f"  {payload.name:<12} {peaks}")
    lines += [f"note: {remark}" for remark in report.remarks]
    return "\n".join(lines)
