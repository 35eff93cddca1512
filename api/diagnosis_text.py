"""A diagnosis and its story as text for the terminal."""

import textwrap
from collections.abc import Iterator

from identify.results.diagnosis import DiagnosisDocument, Learned
from identify.results.improvement import ImprovementDocument
from identify.results.unseen_motion import JointUnseenMotion, UnseenMotionErrors

SHOWN = 6
"""candidates shown for each joint; --json has all"""
VERDICTS = {
    "missing": "the model misses {effects}",
    "adequate": "the model is adequate: what is left is noise",
    "unexplained": "the model misses something that is in no catalogue",
}


def diagnosis_text(document: DiagnosisDocument) -> str:
    """`diagnose --json` as text."""
    return "\n".join(_diagnosis_lines(document))


def _diagnosis_lines(document: DiagnosisDocument) -> Iterator[str]:
    floor = document.noise_floor
    yield (
        f"{document.experiment}, model {document.model}: relative error {_percent(document.relative_error)}"
        f" (noise floor {_percent(floor)})"
    )
    for joint in document.joints:
        effects = ", then ".join(joint.missing)
        yield ""
        yield f"{joint.joint}: {VERDICTS[joint.verdict].format(effects=effects)}"
        yield f"  {'effect':26s} {'held out':>9s} {'with it':>9s} {'by chance':>10s}"
        for candidate in joint.candidates[:SHOWN]:
            mark = "+" if candidate.effect in joint.missing else " "
            yield (
                f"{mark} {candidate.effect:26s} {_percent(candidate.heldout_error_before):>9s} "
                f"{_percent(candidate.heldout_error_after):>9s} {_probability(candidate.p_value):>10s}"
            )
            if candidate.indistinguishable_from:
                yield f"    cannot be distinguished from {', '.join(candidate.indistinguishable_from)}"
        if joint.missing:
            first = next(c for c in joint.candidates if c.effect == joint.missing[0])
            yield from textwrap.wrap(first.explanation, 100, initial_indent="  ", subsequent_indent="  ")
        if joint.learned is not None:
            yield from learned_lines(joint.joint, joint.learned)
        for row in joint.where[:2]:
            where = f"{row.variable} {row.from_:.3g} to {row.to:.3g}"
            if row.variable == "session":
                where = f"session {row.label}"
            elif row.label is not None:
                where = f"time {row.from_:.2f} to {row.to:.2f} s of {row.label}"
            yield f"  {row.share_of_error:.0%} of the squared error lies at {where}"
        strongest = next((each for each in joint.structure if each.found), None)
        if strongest is not None and strongest.variables != ("moments",):  # of these `where` tells when
            yield (
                f"  {strongest.share:.0%} of the power that is left can be predicted from {' and '.join(strongest.variables)}"
            )
        if joint.superfluous:
            yield f"  terms that do not help: {', '.join(joint.superfluous)}"
    if document.remarks:
        yield ""
        yield from document.remarks
    for joint_motion in document.motion or ():
        yield ""
        yield f"with {joint_motion.effect}@{joint_motion.joint}: {motion_text(joint_motion.motion)}"


def improvement_text(document: ImprovementDocument) -> str:
    """`improve --json` as text."""
    lines = [f"{document.experiment}, from the {document.model} model:"]
    for number, step in enumerate(document.steps):
        added = step.added
        name = "start" if added is None else f"+ {added.effect} ({added.joint})"
        checked = step.relative_error_validation
        validation = "" if checked is None else f", on the validation sessions {_percent(checked)}"
        lines.append(f"  {number}. {name:40s} {_percent(step.relative_error):>8s}{validation}")
        if step.motion is not None:
            lines.append(f"     {motion_text(step.motion)}")
    for joint, learned in (document.learned or {}).items():
        lines += [f"{joint}:", *learned_lines(joint, learned)]
    lines.append(f"Verdict: {document.verdict}.")
    return "\n".join(lines)


def learned_lines(joint: str, learned: Learned) -> Iterator[str]:
    """What is offered, its form or its table, and how it is added."""
    yield (
        f"  offered, not added: {learned.effect}, a description and no cause: held out"
        f" {_percent(learned.relative_error_before)}, with it {_percent(learned.relative_error_after)}"
    )
    if learned.form is not None:
        yield f"    {learned.form}  ({learned.unit})"
    heads = ("backwards", "forwards") if learned.variables[1:] == ("direction",) else ("",)
    yield f"    {learned.variables[0]:>10s}  " + "  ".join(
        f"{head + ' ' + learned.unit:>22s}" for head in heads
    )
    width = len(heads)
    for place, knot in enumerate(learned.knots[0]):
        at_knot = range(place * width, (place + 1) * width)
        cells = [_with_deviation(learned.values[each], learned.deviations[each]) for each in at_knot]
        yield f"    {knot:>10.4g}  " + "  ".join(f"{cell:>22s}" for cell in cells)
    yield f"    to try it: --keep-learned, then --add {learned.effect}@{joint}"


def _with_deviation(value: float, deviation: float | None) -> str:
    return f"{value:.4g}" if deviation is None else f"{value:.4g} ± {deviation:.2g}"


def motion_text(motion: UnseenMotionErrors) -> str:
    """How well motion is predicted that the fit did not see, and what got worse."""
    text = f"{motion.horizon:g} s ahead on unseen motion: {', '.join(map(_motion_of_joint, motion.joints))}"
    if motion.worse:
        text += f"; it helps the torque and hurts the motion of {', '.join(motion.worse)}"
    return text


def _motion_of_joint(joint: JointUnseenMotion) -> str:
    before = "" if joint.position_rms_before is None else f"{joint.position_rms_before:.3g} → "
    return f"{joint.joint} {before}{'–' if joint.position_rms is None else f'{joint.position_rms:.3g}'} {joint.unit}"


def _percent(value: float | None) -> str:
    return "unknown" if value is None else f"{100 * value:.2f} %"


def _probability(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.1e}"
