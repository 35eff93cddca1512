"""Motion judges too: whether an effect that lowers the torque error also predicts motion that no fit saw."""

from collections.abc import Sequence

from identify.effects.model import Term
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model
from identify.results.unseen_motion import EffectOnMotion, UnseenMotionErrors


def motion_of_story(story: Sequence[FittedModel]) -> list[UnseenMotionErrors | None]:
    """Of each model, compared with the one before it; None where the sessions are shorter than a window."""
    # Imported where needed: simulation is much to load, and most diagnoses do not ask for it.
    from identify.simulation.unseen_motion import unseen_motion

    errors: list[UnseenMotionErrors | None] = []
    before = None
    for fitted in story:
        present = unseen_motion(fitted)
        errors.append(None if present is None else present.document(fitted.record, before))
        before = present
    return errors


def effects_on_motion(fitted: FittedModel, added: Sequence[Term]) -> tuple[EffectOnMotion, ...]:
    """What each of the effects does, added one after the other to a fitted model."""
    story = [fitted]
    for term in added:
        last = story[-1]
        story.append(fit_model(last.record, last.model.with_terms([term]), start=last))
    errors = motion_of_story(story)[1:]
    names = fitted.record.joint_names
    return tuple(
        EffectOnMotion(effect=term.effect.name, joint=names[term.joint], motion=motion)
        for term, motion in zip(added, errors, strict=True)
        if motion is not None
    )
