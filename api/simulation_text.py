"""The errors of simulated motion as text for the terminal."""

from collections.abc import Iterator

from identify.results.simulation import HorizonErrors, JointMotionError, SimulationDocument

GAINS = {
    "file": "gains from a file",
    "estimated": "gains told from the record",
    "drives": "gains read from the drives before the sessions",
}


def simulation_text(document: SimulationDocument) -> str:
    """`simulate --json` as text."""
    return "\n".join(_lines(document))


def _lines(document: SimulationDocument) -> Iterator[str]:
    driven = "the recorded torque"
    if document.controller is not None:
        driven = f"its controllers ({GAINS[document.controller.source]})"
    yield f"{document.experiment}, model {document.model}, driven by {driven}:"
    yield f"effects: {', '.join(str(effect) for effect in document.effects)}"
    if document.controller is not None and document.controller.coordinates == "motors":
        yield "each controller sees its motor, in units of its joint"
    yield "root mean square of simulated less measured motion"
    for errors in document.horizons:
        yield ""
        yield _heading(errors)
        beside = any(joint.position_rms_usual is not None for joint in errors.joints)
        yield f"  {'joint':10s} {'position':>14s} {'speed':>16s}" + (
            f" {'usual model:':>14s} {'position':>14s} {'speed':>16s}" if beside else ""
        )
        for joint in errors.joints:
            yield _row(joint, beside)
        if errors.energy_drift is not None:
            yield f"  energy drift {100 * errors.energy_drift:.2g} % of the work done"
    if document.unseen is not None:
        where = (
            "validation sessions"
            if document.unseen.unseen == "validation"
            else "stretches left out of the fit"
        )
        if document.controller is not None:
            where += ", driven by the recorded torque"
        yield ""
        yield f"{document.unseen.horizon:g} s ahead where the fit did not see ({where}):"
        for joint in document.unseen.joints:
            beside = (
                ""
                if joint.position_rms_before is None
                else (f", usual model {_figure(joint.position_rms_before, joint.unit)}")
            )
            verdict = "  worse than the usual model" if joint.worse else ""
            yield f"  {joint.joint:10s} {_figure(joint.position_rms, joint.unit):>14s}{beside}{verdict}"
    yield ""
    for effect in document.formed:
        if effect.state:
            yield f"{effect.effect}@{effect.joint}: simulated with a state of its own, {effect.state}"
        elif effect.formed == "command":
            yield f"{effect.effect}@{effect.joint}: shifts the recorded command in time"
        elif effect.formed == "left-out":
            yield f"{effect.effect}@{effect.joint}: left out"
    if document.inputs:
        yield f"Taken from the record after each start: {', '.join(document.inputs)}."
        yield "The measured motion gives the state at the start alone, whose speed is filtered from rows to either side."
    for remark in document.remarks:
        yield f"Remark: {remark}"


def _heading(errors: HorizonErrors) -> str:
    sessions = f"{errors.role} sessions"
    if errors.horizon is None:
        return f"Free run from the start, {sessions}:"
    windows = errors.joints[0].windows
    return f"{errors.horizon:g} s ahead, {sessions}, {windows} window{'' if windows == 1 else 's'}:"


def _row(joint: JointMotionError, beside: bool) -> str:
    speed = f"{joint.unit}/s"
    text = f"  {joint.joint:10s} {_figure(joint.position_rms, joint.unit):>14s} {_figure(joint.velocity_rms, speed):>16s}"
    if beside:
        text += (
            f" {'':>14s} {_figure(joint.position_rms_usual, joint.unit):>14s}"
            f" {_figure(joint.velocity_rms_usual, speed):>16s}"
        )
    return text + _left(joint, beside)


def _left(joint: JointMotionError, beside: bool) -> str:
    """When a free run has left the record, and that of the usual model where it stands beside."""
    if not beside:
        return (
            ""
            if joint.left_record_at is None
            else f"  a tenth of its range off at {joint.left_record_at:.3g} s"
        )
    both = (("model", joint.left_record_at), ("usual model", joint.left_record_at_usual))
    times = [f"{name} at {instant:.3g} s" for name, instant in both if instant is not None]
    return f"  a tenth of its range off: {', '.join(times)}" if times else ""


def _figure(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:.3g} {unit}"
