"""The errors of simulated motion as text for the terminal."""

from collections.abc import Iterator

from identify.results.simulation import (
    EffectInSimulation,
    HorizonErrors,
    JointMotionError,
    SimulationDocument,
)
from identify.results.unseen_motion import UnseenMotionErrors

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
        yield ""
        yield f"{document.unseen.horizon:g} s ahead where the fit did not see ({unseen_words(document.unseen, document)}):"
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
        formed = formed_words(effect)
        if formed is not None:
            yield formed
    if document.inputs:
        yield input_words(document)
        yield "The measured motion gives the state at the start alone, whose speed is filtered from rows to either side."
    for remark in document.remarks:
        yield f"Remark: {remark}"


def unseen_words(unseen: UnseenMotionErrors, document: SimulationDocument) -> str:
    """Which motion the fit did not see, and what drives the model there in a simulation that closes the loop elsewhere."""
    where = "validation sessions" if unseen.unseen == "validation" else "stretches left out of the fit"
    return where if document.controller is None else f"{where}, driven by the recorded torque"


def formed_words(effect: EffectInSimulation) -> str | None:
    """How a simulation forms an effect's torque; None where it follows from the instant."""
    name = f"{effect.effect}@{effect.joint}"
    if effect.state:
        return f"{name}: simulated with a state of its own, {effect.state}"
    return {
        "command": f"{name}: shifts the recorded command in time",
        "left-out": f"{name}: left out",
    }.get(effect.formed)


def input_words(document: SimulationDocument) -> str:
    """What of the record after its start a simulation was given, in a sentence."""
    return f"Taken from the record after each start: {', '.join(document.inputs)}."


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
