"""How well a model predicts motion that its fit did not see: a part of several documents."""

from typing import Literal

from pydantic import Field

from identify.results.document import Figure, Part


class JointUnseenMotion(Part):
    """Of one joint, root mean squares over all windows."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    position_rms: Figure = Field(description="simulated less measured position, rad or m", examples=[0.0015])
    position_rms_before: Figure = Field(
        default=None,
        description="of the model that it is compared with (without the effect added; else the usual one), on the same windows",
        examples=[0.0031],
    )
    unit: Literal["rad", "m"] = Field(description="of the position", examples=["rad"])
    worse: bool = Field(
        default=False,
        description="whether it is worse than that model's, beyond what the windows leave in doubt",
        examples=[False],
    )


class UnseenMotionErrors(Part):
    """Errors of windows begun at measured states, in motion that the fit did not see."""

    horizon: float = Field(description="s, length of a window", examples=[1.0])
    unseen: Literal["validation", "stretches"] = Field(
        description="the validation sessions; or stretches of the others, each predicted by a fit without it"
    )
    windows: int = Field(description="how many", examples=[25])
    joints: tuple[JointUnseenMotion, ...] = Field(description="of each joint")

    @property
    def worse(self) -> tuple[str, ...]:
        """Joints whose motion is predicted worse than by the model compared with."""
        return tuple(joint.joint for joint in self.joints if joint.worse)


class EffectOnMotion(Part):
    """What an effect does to the prediction of motion, beside the model with the effects before it."""

    effect: str = Field(description="name in the catalogue", examples=["viscous-asymmetric"])
    joint: str = Field(description="name of the joint that it is added to", examples=["slide"])
    motion: UnseenMotionErrors = Field(description="with the effect, compared with the model without it")
