"""A model improved step by step: the document of `coulomb improve --json`."""

from collections.abc import Mapping

from pydantic import Field

from identify.results.diagnosis import Learned, Verdict
from identify.results.document import Document, Figure, Part
from identify.results.effect import EffectOnJoint
from identify.results.unseen_motion import UnseenMotionErrors


class StepJoint(Part):
    """Errors of one joint after a step; parts of the measured torque."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    relative_error: Figure = Field(description="on the sessions of the fit", examples=[0.0484])
    relative_error_validation: Figure = Field(description="on the validation sessions", examples=[0.0499])
    heldout_error: Figure = Field(description="on motion that the fit did not see", examples=[0.0501])


class Step(Part):
    """One step of an improvement; the first is the start."""

    added: EffectOnJoint | None = Field(description="null for the start")
    relative_error: Figure = Field(
        description="‖Y − Wχ‖ / ‖Y‖ over all joints, part of the measured torque", examples=[0.0484]
    )
    relative_error_validation: Figure = Field(
        description="the same on the validation sessions; null where there are none", examples=[0.0499]
    )
    joints: tuple[StepJoint, ...] | None = Field(
        default=None, description="errors of each joint; null where not computed"
    )
    motion: UnseenMotionErrors | None = Field(
        default=None,
        description="how well motion is predicted that the fit did not see, compared with the step before; null where it was"
        " not asked for, or no session is long enough",
    )


class ImprovementDocument(Document):
    """The document of `coulomb improve --json`."""

    MADE_BY = "coulomb improve --json"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="the model at the start, as requested", examples=["usual"])
    steps: tuple[Step, ...] = Field(description="the start and each addition")
    verdict: Verdict = Field(
        description="the worst over the joints after the last step", examples=["adequate"]
    )
    learned: Mapping[str, Learned] | None = Field(
        default=None,
        description="by joint, a description of what is still unexplained after the last step, where one holds; it is offered,"
        " not added; null where not looked for",
    )
