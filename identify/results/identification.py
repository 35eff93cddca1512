"""What an identification found: the document of `coulomb identify --json`."""

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import ConfigDict, Field

from identify.results.document import Document, Figure, Part
from identify.results.effect import EffectOnJoint

Role = Literal["identification", "validation", "left out"]
"""How a session was used: fitted, checked, or neither because the request left it out."""


class JointError(Part):
    """Errors of one joint, ‖Y − Wχ‖ / ‖Y‖ on the filtered, decimated samples; parts of the measured torque."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    relative_error: Figure = Field(description="on the sessions of the fit", examples=[0.0733])
    relative_error_validation: Figure = Field(description="on the validation sessions", examples=[0.081])
    noise_floor: Figure = Field(
        description="relative error that noise alone would leave, from what the model leaves of repeated motion; null without "
        "repeats",
        examples=[0.031],
    )
    noise_floor_interval: tuple[float, float] | None = Field(
        default=None,
        description="of the noise floor, 95 %; null where there is none",
        examples=[[0.029, 0.033]],
    )


class SessionError(Part):
    """Error of one session over all joints."""

    file: str = Field(description="of the recording, in the experiment's folder", examples=["session-00.csv"])
    payload: str = Field(description="name of the payload", examples=["none"])
    role: Role = Field(description="how the session was used", examples=["identification"])
    relative_error: Figure = Field(description="‖Y − Wχ‖ / ‖Y‖, part of the measured torque", examples=[0.07])
    duration: Figure = Field(
        default=None, description="s of samples; null in documents of earlier versions", examples=[60.0]
    )


class ExcludedSession(Part):
    """A session that the experiment lists and excludes: the model neither uses it nor is checked on it."""

    file: str = Field(description="of the recording, in the experiment's folder", examples=["session-02.h5"])
    payload: str = Field(description="name of the payload", examples=["disk"])
    reason: str = Field(description="as whoever excluded it gave it", examples=["the payload was loose"])


class Parameter(Part):
    """One estimated parameter, in the unit of `unit`."""

    name: str = Field(description="symbol with the joint's number, R for regrouped", examples=["ZZ1R"])
    joint: str = Field(description="the joint it belongs to", examples=["j3"])
    value: float = Field(description="estimate", examples=[30.9])
    std: Figure = Field(description="standard deviation of eq. (14)-(15)", examples=[0.14])
    std_robust: Figure = Field(
        description="standard deviation that holds for autocorrelated residuals", examples=[0.4]
    )
    relative_std_percent: Figure = Field(description="eq. (16), % of the value", examples=[0.46])
    unit: str = Field(description="of value and deviations", examples=["kg m^2"])
    grouping: str | None = Field(
        description="standard parameters that it regroups; null where it regroups none",
        examples=["ZZ1 + Ia1"],
    )
    doubt: str | None = Field(
        default=None,
        description="what makes the value meaningless or impossible (a negative inertia, friction held at 0, two huge values "
        "that cancel); null where nothing does",
        examples=[None],
    )


class Excitation(Part):
    """What the motion of this record can tell of the model, to be read before any parameter."""

    verdict: Literal["sufficient", "partial", "insufficient"] = Field(
        description="sufficient: it shows all that the model has; partial: not all of it, see `cannot_tell`; insufficient: "
        "the parameters cannot be relied on",
        examples=["partial"],
    )
    cannot_tell: tuple[str, ...] = Field(
        description="what it does not show, the gravest first, and what would",
        examples=[["MY1R, XZ2: not seen"]],
    )


class EliminatedParameter(Part):
    """A parameter that was taken out because the data do not show it (section IV.D), and what that cost."""

    name: str = Field(description="symbol", examples=["MY1R"])
    joint: str = Field(description="the joint it belongs to", examples=["j3"])
    relative_std_percent: Figure = Field(
        description="std_robust when it was taken out, % of the value", examples=[140.0]
    )
    relative_error_before: float = Field(description="‖Y − Wχ‖ / ‖Y‖ with it", examples=[0.0733])
    relative_error_after: float = Field(description="‖Y − Wχ‖ / ‖Y‖ without it", examples=[0.0734])


class EffectConstants(Part):
    """Nonlinear constants that were searched for one effect on one joint; each a key with its value.

    Names and units are those that the effect declares, e.g. `stribeck_velocity` in rad/s.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, float] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    effect: str = Field(description="name in the catalogue", examples=["stribeck"])
    joint: str = Field(description="name of the joint", examples=["j3"])

    @classmethod
    def of(cls, effect: str, joint: str, values: Mapping[str, float]) -> Self:
        """The constants of one effect on one joint."""
        return cls.model_validate({"effect": effect, "joint": joint, **values})

    @property
    def values(self) -> dict[str, float]:
        """The constants by name."""
        return dict(self.__pydantic_extra__)


class PayloadError(Part):
    """Error over all sessions with one payload in one role (Table IV)."""

    payload: str = Field(description="name of the payload", examples=["disk-7"])
    mass: Figure = Field(description="kg, as declared; null where it was estimated", examples=[6.97])
    role: Role = Field(description="how the sessions were used", examples=["identification"])
    relative_error: Figure = Field(description="‖Y − Wχ‖ / ‖Y‖, part of the measured torque", examples=[0.07])


class JointSpeedError(Part):
    """Errors of one joint in a range of speed; parts of the measured torque."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    relative_error: Figure = Field(description="on the sessions of the fit", examples=[0.07])
    relative_error_validation: Figure = Field(description="on the validation sessions", examples=[0.08])
    samples: int = Field(description="decimated samples of the fit's sessions in this range", examples=[812])


class SpeedError(Part):
    """Errors in a range of speed (Table III); parts of the measured torque."""

    range: str = Field(description="all, low or high", examples=["low"])
    from_: float = Field(
        validation_alias="from",
        serialization_alias="from",
        description="part of the joint's top speed",
        examples=[0.0],
    )
    to: float = Field(description="part of the joint's top speed", examples=[0.1])
    relative_error: Figure = Field(description="on the sessions of the fit, over all joints", examples=[0.07])
    relative_error_validation: Figure = Field(description="on the validation sessions", examples=[0.08])
    samples: int = Field(description="decimated samples of the fit's sessions in this range", examples=[812])
    joints: tuple[JointSpeedError, ...] = Field(description="the same for each joint")


class SignalChoice(Part):
    """One setting of the filters, with its reason."""

    name: str = Field(description="what was chosen", examples=["position cut-off of j3"])
    value: float = Field(description="in `unit`", examples=[40.0])
    unit: str = Field(description="of the value", examples=["Hz"])
    reason: str = Field(description="why this value", examples=["ten times the fastest motion"])


class StructuredEstimate(Part):
    """The load-velocity model with one value for each physical parameter, instead of eq. (30)'s products."""

    relative_error: Figure = Field(description="‖Y − Wχ‖ / ‖Y‖, part of the measured torque", examples=[0.06])
    parameters: tuple[Parameter, ...] = Field(description="the physical parameters")


class FeasibleBaseParameter(Part):
    """A base parameter of real bodies beside its estimate."""

    name: str = Field(description="symbol", examples=["ZZ1R"])
    estimate: float = Field(description="as identified, in `unit`", examples=[30.9])
    value: float = Field(description="physically consistent, in `unit`", examples=[30.8])
    unit: str = Field(description="of both", examples=["kg m^2"])


class FeasibleStandardParameter(Part):
    """A standard parameter of a real body."""

    name: str = Field(description="symbol", examples=["ZZ1"])
    value: float = Field(description="in `unit`", examples=[12.1])
    unit: str = Field(description="of the value", examples=["kg m^2"])


class FeasibleParameters(Part):
    """The nearest parameters that belong to real bodies."""

    weighted_error_of_estimate: float = Field(
        description="weighted relative error of the fit", examples=[0.07]
    )
    weighted_error_of_feasible: float = Field(
        description="the same with the consistent ones", examples=[0.071]
    )
    base: tuple[FeasibleBaseParameter, ...] = Field(description="base parameters")
    standard: tuple[FeasibleStandardParameter, ...] = Field(description="one choice of standard parameters")
    remark: str = Field(
        description="what to know of the standard parameters", examples=["one choice of many"]
    )


class PriorParameter(Part):
    """A base parameter by the bodies in a file of the robot, beside what was identified."""

    name: str = Field(description="symbol with the joint's number, R for regrouped", examples=["MX2R"])
    joint: str = Field(description="the joint it belongs to", examples=["j2"])
    unit: str = Field(description="of values and deviation", examples=["kg m"])
    by_file: float = Field(description="by masses, centres and inertias of the file", examples=[4.1])
    identified: Figure = Field(description="estimate; null where the record does not show it", examples=[4.6])
    std_robust: Figure = Field(description="of the estimate, under autocorrelated residuals", examples=[0.1])
    deviations: Figure = Field(description="(identified - by_file) / std_robust", examples=[5.0])
    rotor: bool = Field(
        description="whether it groups a rotor's inertia, which the file lacks", examples=[False]
    )


class PriorComparison(Part):
    """What was identified beside what a file of the robot states, mostly from CAD."""

    file: str = Field(description="URDF, SDF or MJCF", examples=["arm.urdf"])
    parameters: tuple[PriorParameter, ...] = Field(description="all base parameters")
    remarks: tuple[str, ...] = Field(description="what the reader must know of it", examples=[[]])


class IdentificationDocument(Document):
    """The document of `coulomb identify --json`: a model fitted over all sessions so far."""

    MADE_BY = "coulomb identify --json"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="as requested: rigid, usual, load-velocity, rigid+…", examples=["usual"])
    effects: tuple[EffectOnJoint, ...] = Field(description="every effect of the model, on every joint")
    rotors: bool = Field(
        default=True,
        description="whether the torque is the motors'; false where it was measured on the links' side (link-side): the"
        " model then has no rotor inertia and no friction of motor and gear",
        examples=[True],
    )
    relative_error: Figure = Field(
        description="‖Y − Wχ‖ / ‖Y‖ over all joints and sessions of the fit, part of the measured torque",
        examples=[0.0733],
    )
    relative_error_validation: Figure = Field(
        description="the same on the validation sessions; null where there are none", examples=[0.081]
    )
    joints: tuple[JointError, ...] = Field(description="errors of each joint")
    sessions: tuple[SessionError, ...] = Field(description="errors of each session")
    excluded: tuple[ExcludedSession, ...] = Field(
        default=(), description="sessions that the experiment excludes, with the reason"
    )
    parameters: tuple[Parameter, ...] = Field(description="what was estimated")
    condition_number: Figure = Field(description="of the scaled observation matrix", examples=[31.2])
    samples: int = Field(description="decimated rows of the fit, over all joints", examples=[6021])
    form: Literal["linear", "structured"] = Field(
        description="of load-velocity: eq. (30) with its products, or one value for each physical parameter",
        examples=["linear"],
    )
    estimator: str = Field(description="ordinary, weighted, robust, instrumental", examples=["weighted"])
    eliminated: tuple[EliminatedParameter, ...] = Field(
        description="in the order in which they were taken out"
    )
    constants: tuple[EffectConstants, ...] = Field(description="nonlinear constants of the effects")
    relative_error_left_out: Figure = Field(
        description="on identification sessions that the request left out; null where there are none",
        examples=[None],
    )
    payloads: tuple[PayloadError, ...] = Field(description="errors by payload (Table IV)")
    speeds: tuple[SpeedError, ...] = Field(description="errors by speed (Table III)")
    signals: tuple[SignalChoice, ...] = Field(description="settings of the filters")
    not_identifiable: tuple[str, ...] = Field(
        description="parameters that this record does not determine", examples=[["MY1R"]]
    )
    remarks: tuple[str, ...] = Field(description="what the reader must know of it", examples=[[]])
    excitation: Excitation | None = Field(
        default=None, description="what this motion can tell; null in results of earlier versions"
    )
    structured: StructuredEstimate | None = Field(
        default=None, description="of load-velocity; null for other models"
    )
    feasible: FeasibleParameters | None = Field(default=None, description="where `--feasible` asked for them")
    prior: PriorComparison | None = Field(
        default=None,
        description="where the experiment declares the links' bodies, or `--robot` names their file",
    )
