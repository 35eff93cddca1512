"""What effects do to predicted motion: said beside the torque's errors, and marked where they hurt it."""

from api.pages.effect_motion import effects_on_motion, motion_of_step
from identify.results.diagnosis import DiagnosisDocument
from identify.results.unseen_motion import EffectOnMotion, JointUnseenMotion, UnseenMotionErrors


def on_motion(effect: str, joint: str, worse: bool) -> EffectOnMotion:
    parts = [
        JointUnseenMotion(
            joint=name, position_rms=2e-3, position_rms_before=1e-3, unit="rad", worse=worse and name == "j2"
        )
        for name in ("j1", "j2")
    ]
    motion = UnseenMotionErrors(horizon=1.0, unseen="stretches", windows=9, joints=tuple(parts))
    return EffectOnMotion(effect=effect, joint=joint, motion=motion)


def diagnosis(*motion: EffectOnMotion, asked: bool = True) -> DiagnosisDocument:
    return DiagnosisDocument.model_construct(motion=motion if asked else None)


def test_the_missing_effects_of_a_joint_stand_with_both_errors_and_whom_they_hurt() -> None:
    document = diagnosis(on_motion("stribeck", "j1", worse=True), on_motion("backlash", "j2", worse=False))
    (shown,) = effects_on_motion(document, "j1")
    assert (shown.effect, shown.without, shown.with_, shown.hurts) == (
        "stribeck",
        "1 mrad",
        "2 mrad",
        ("j2",),
    )
    assert effects_on_motion(diagnosis(asked=False), "j1") is None
    assert effects_on_motion(None, "j1") is None


def test_a_step_has_the_motion_of_what_it_added_and_is_marked_on_the_joint_that_it_hurts() -> None:
    document = diagnosis(on_motion("stribeck", "j1", worse=True))
    assert motion_of_step(document, {"stribeck@j1"}, "j2") == ("2 mrad", True)
    assert motion_of_step(document, {"stribeck"}, "j1") == ("2 mrad", False)
    assert motion_of_step(document, {"backlash@j1"}, "j2") == (None, False)
    assert motion_of_step(diagnosis(asked=False), {"stribeck@j1"}, "j2") == (None, False)
    assert motion_of_step(None, {"stribeck@j1"}, "j2") == (None, False)
