"""The documents that `identify`, `diagnose`, `improve` and `effects` print and the service answers, as
typed models.

SI units, joint space. A figure that cannot be given is None. Further fields may come; they are kept.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from identify.effects.picture import PictureVariable


class _Document(BaseModel):
    model_config = ConfigDict(extra="allow", populate_by_name=True)


class EffectOnJoint(_Document):
    """One effect of a model, on one joint."""

    effect: str = Field(examples=["viscous"])
    joint: str | None = Field(default=None, examples=["j3"])


class JointError(_Document):
    """Errors of one joint, ‖Y − Wχ‖ / ‖Y‖ on the filtered, decimated samples."""

    joint: str = Field(examples=["j3"])
    relative_error: float | None = Field(examples=[0.0733])
    relative_error_validation: float | None = Field(examples=[0.081])
    noise_floor: float | None = Field(examples=[0.031])


class SessionError(_Document):
    """Error of one session."""

    file: str = Field(examples=["session-00.csv"])
    payload: str = Field(examples=["none"])
    relative_error: float | None = Field(examples=[0.07])


class Parameter(_Document):
    """One identified base parameter; `std` as in eq. (14)-(15), `std_robust` holds under autocorrelation."""

    name: str = Field(examples=["ZZ1R"])
    joint: str | None = Field(examples=["j3"])
    value: float | None = Field(examples=[30.9])
    std: float | None = Field(examples=[0.14])
    std_robust: float | None = Field(examples=[0.4])
    relative_std_percent: float | None = Field(examples=[0.46])
    unit: str | None = Field(examples=["kg m^2"])
    grouping: str | None = Field(examples=["ZZ1 + Ia1"])


class Identification(_Document):
    """The document of `coulomb identify --json`."""

    experiment: str = Field(examples=["rx130l-joint3"])
    model: str = Field(examples=["usual"])
    effects: list[EffectOnJoint]
    relative_error: float | None = Field(examples=[0.0733])
    relative_error_validation: float | None = Field(examples=[0.081])
    joints: list[JointError]
    sessions: list[SessionError]
    parameters: list[Parameter]
    condition_number: float | None = Field(examples=[31.2])
    samples: int = Field(examples=[6021])


class Candidate(_Document):
    """One effect that might be missing, with its evidence."""

    effect: str = Field(examples=["load-friction-asymmetric"])
    rank: int | None = Field(examples=[1])
    relative_error_before: float | None = Field(examples=[0.0733])
    relative_error_after: float | None = Field(examples=[0.0484])
    heldout_error_before: float | None = Field(examples=[0.075])
    heldout_error_after: float | None = Field(examples=[0.0499])
    p_value: float | None = Field(examples=[1e-30])
    indistinguishable_from: list[str] = Field(examples=[[]])
    explanation: str | None = Field(
        examples=["Friction grows with the load, and differently when it drives."]
    )


class Where(_Document):
    """A range of one variable in which a share of the error sits."""

    variable: str = Field(examples=["dq"])
    from_: float | None = Field(alias="from", examples=[-0.1])
    to: float | None = Field(examples=[0.1])
    share_of_error: float | None = Field(examples=[0.6])


class JointDiagnosis(_Document):
    """What is missing on one joint."""

    joint: str = Field(examples=["j3"])
    verdict: Literal["missing", "adequate", "unexplained"] = Field(examples=["missing"])
    missing: list[str] = Field(examples=[["load-friction-asymmetric"]])
    candidates: list[Candidate]
    where: list[Where]


class Diagnosis(_Document):
    """The document of `coulomb diagnose --json`."""

    experiment: str = Field(examples=["rx130l-joint3"])
    model: str = Field(examples=["usual"])
    relative_error: float | None = Field(examples=[0.0733])
    noise_floor: float | None = Field(examples=[0.031])
    joints: list[JointDiagnosis]


class Proposal(_Document):
    """An experiment that would tell two rival effects apart, and by how much."""

    payload: str = Field(examples=["disk-7"])
    shape: Literal["sinusoid", "trapezoid"] = Field(examples=["trapezoid"])
    speed: float = Field(description="rad/s or m/s at most", examples=[0.36])
    position_from: float = Field(description="rad or m", examples=[-1.2])
    position_to: float = Field(examples=[1.6])
    repeats: int = Field(examples=[2])
    separation: float | None = Field(
        description="standard deviations of the noise by which the predictions part", examples=[14.2]
    )
    decides: bool = Field(examples=[True])


class NextExperiment(_Document):
    """The document of `coulomb next --json`."""

    joint: str | None = Field(examples=["j3"])
    rivals: list[str] = Field(examples=[["load-friction-asymmetric", "load-friction"]])
    separation_so_far: float | None = Field(default=None, examples=[1.9])
    proposals: list[Proposal]
    posture: list[float] = Field(
        default=[], description="rad or m: where the other joints stand", examples=[[0.2]]
    )
    advice: str = Field(examples=["A trapezoid between -1.2 and 1.6 with payload disk-7 decides."])


class Step(_Document):
    """One step of an improvement; the first is the start."""

    added: EffectOnJoint | None
    relative_error: float | None = Field(examples=[0.0484])
    relative_error_validation: float | None = Field(examples=[0.0499])


class Improvement(_Document):
    """The document of `coulomb improve --json`."""

    experiment: str = Field(examples=["rx130l-joint3"])
    steps: list[Step]
    verdict: str = Field(examples=["adequate"])


class Effect(_Document):
    """One effect of the catalogue (`coulomb effects --json`)."""

    effect: str = Field(examples=["viscous"])
    title: str = Field(description="name in an operator's words", examples=["viscous friction"])
    group: str = Field(examples=["friction"])
    equation: str = Field(examples=["F_v·dq"])
    explanation: str = Field(examples=["Friction that grows with the speed, as of oil."])
    regressors: list[str] | str | int | None = Field(examples=[["dq"]])
    needs: list[str] | str | None = Field(examples=[[]])
    source: str | None = Field(examples=["eq. (8)"])
    picture: PictureVariable = Field(description="what its picture shows the residual over")
