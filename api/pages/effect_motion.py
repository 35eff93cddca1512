"""What effects do to predicted motion, as a diagnosis says when it is asked: some help the torque and hurt the motion."""

from collections.abc import Collection
from dataclasses import dataclass

from api.pages.motion_table import figure
from identify.results.diagnosis import DiagnosisDocument
from identify.results.unseen_motion import EffectOnMotion


@dataclass(frozen=True)
class EffectMotion:
    """Error of position a second ahead where the fit did not see, of the joint that an effect is added to.

    without, with_ : with their unit
    hurts          : joints whose motion is predicted worse with it
    """

    effect: str
    without: str
    with_: str
    hurts: tuple[str, ...]


def effects_on_motion(document: DiagnosisDocument | None, joint: str) -> list[EffectMotion] | None:
    """Of the missing effects of a joint, one added after the other; None where motion was not asked for."""
    if document is None or document.motion is None:
        return None
    return [_shown(each, joint) for each in document.motion if each.joint == joint]


def motion_of_step(
    before: DiagnosisDocument | None, added: Collection[str], joint: str
) -> tuple[str | None, bool]:
    """Error of a version's motion on a joint, and whether it is worse than that of the version before, as the diagnosis of that
    one found of the effects that were added since; (None, False) where it did not.

    added : as in `--add`, with or without a joint
    """
    if before is None or before.motion is None:
        return None, False
    entries = [each for each in before.motion if {each.effect, f"{each.effect}@{each.joint}"} & set(added)]
    if not entries:
        return None, False
    return _shown(entries[-1], joint).with_, any(joint in each.motion.worse for each in entries)


def _shown(each: EffectOnMotion, joint: str) -> EffectMotion:
    of_joint = next(part for part in each.motion.joints if part.joint == joint)
    return EffectMotion(
        each.effect,
        figure(of_joint.position_rms_before, of_joint.unit),
        figure(of_joint.position_rms, of_joint.unit),
        each.motion.worse,
    )
