"""Where a model fails and which effect is missing: the document of `coulomb diagnose --json`."""

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from identify.results.document import Document, Figure, Part
from identify.results.unseen_motion import EffectOnMotion

Verdict = Literal["missing", "adequate", "unexplained"]
"""missing: catalogue effects are justified; adequate: what is left is noise; unexplained: structure is left that no
catalogue effect explains."""


class Estimate(Part):
    """A parameter of a candidate, estimated beside the model."""

    name: str = Field(description="symbol with the joint's number", examples=["FS1"])
    value: Figure = Field(description="in `unit`", examples=[0.31])
    std_robust: Figure = Field(
        description="standard deviation that holds for autocorrelated residuals, in `unit`", examples=[0.04]
    )
    unit: str = Field(description="of value and deviation", examples=["N m"])


class Candidate(Part):
    """One effect that might be missing on a joint, with its evidence. Errors are parts of the measured torque."""

    effect: str = Field(description="name in the catalogue", examples=["load-friction-asymmetric"])
    rank: int = Field(description="1 is the best", examples=[1])
    relative_error_before: Figure = Field(description="in the fit, without it", examples=[0.0733])
    relative_error_after: Figure = Field(description="in the fit, with it", examples=[0.0484])
    heldout_error_before: Figure = Field(
        description="on motion that the fit did not see, without it", examples=[0.075]
    )
    heldout_error_after: Figure = Field(
        description="on motion that the fit did not see, with it", examples=[0.0499]
    )
    p_value: Figure = Field(description="probability of such a gain by chance, 0 to 1", examples=[1e-30])
    justified: bool = Field(description="whether the evidence is enough to add it", examples=[True])
    indistinguishable_from: tuple[str, ...] = Field(
        description="effects that explain these data alike", examples=[["load-friction"]]
    )
    caution: str | None = Field(description="what these data cannot tell of it", examples=[None])
    explanation: str = Field(
        description="the physics, in an operator's words",
        examples=["Friction grows with the load, and differently when it drives."],
    )
    equation: str = Field(description="the torque it adds", examples=["F_s·|τ_out|·sign(dq)"])
    variable: str = Field(description="what its torque is seen over", examples=["load"])
    constants: Mapping[str, float] = Field(
        description="nonlinear constants found for it; units as the effect declares them",
        examples=[{"stribeck_velocity": 0.1}],
    )
    probability: Figure = Field(
        default=None, description="that it is missing, 0 to 1; null where not computed", examples=[0.97]
    )
    estimates: tuple[Estimate, ...] | None = Field(
        default=None, description="its parameters beside the model; null where not computed"
    )


class Where(Part):
    """A range of one variable in which more of the error sits than its share of the samples."""

    variable: str = Field(
        description="dq, q, ddq, load, time, travel since reversal, temperature or session", examples=["dq"]
    )
    from_: int | float = Field(
        validation_alias="from",
        serialization_alias="from",
        description="in the variable's SI unit; of a session its number from 0; time counts from the session's"
        " start, with a label as it is recorded",
        examples=[-0.1],
    )
    to: int | float = Field(description="as `from`", examples=[0.1])
    label: str | None = Field(
        default=None,
        description="of a session its file; of a time that of the one session in which it is, if not of all",
        examples=[None],
    )
    share_of_error: float = Field(description="of the squared error, 0 to 1", examples=[0.6])
    share_of_samples: float = Field(description="of the samples in motion, 0 to 1", examples=[0.2])
    excess: float = Field(description="share of error less share of samples", examples=[0.4])


class LeftoverStructure(Part):
    """What a predictor without any model still finds in the error, after the missing effects are added."""

    variables: tuple[str, ...] = Field(description="what it predicts from", examples=[["q", "dq"]])
    share: Figure = Field(
        description="of the squared error that it predicts on unseen motion", examples=[0.02]
    )
    deviation: Figure = Field(description="standard deviation of that share", examples=[0.01])
    found: bool = Field(description="whether that is more than chance", examples=[False])


class Learned(Part):
    """A description of what no catalogue effect explains, offered as an effect. It names no cause."""

    effect: str = Field(description="its name, as an own effect", examples=["learned-position-j3"])
    variables: tuple[str, ...] = Field(
        description="q, dq, load, time, temperature, or the position of another joint, q and its number; behind it `direction`"
        " where the torque differs between the directions of motion",
        examples=[["q"]],
    )
    form: str | None = Field(
        description="a short closed form that does as well, in the language of own effects; null where none does",
        examples=["max(0, q - 0.71)**1.5"],
    )
    knots: tuple[tuple[float, ...], ...] = Field(
        description="support points of each variable, in its SI unit", examples=[[[-1.0, 0.0, 1.0]]]
    )
    values: tuple[float, ...] = Field(
        description="torque at the support points, in `unit`; of two variables the last one runs fastest",
        examples=[[0.1, 0.0, -0.1]],
    )
    deviations: tuple[Figure, ...] = Field(
        description="standard deviation of each value, which holds for autocorrelated residuals; null where not known",
        examples=[[0.01, 0.01, 0.02]],
    )
    unit: str = Field(description="of the values: N m or N", examples=["N m"])
    relative_error_before: Figure = Field(
        description="of the joint without it, on motion that the fit did not see", examples=[0.045]
    )
    relative_error_after: Figure = Field(
        description="of the joint with it, on motion that the fit did not see", examples=[0.031]
    )
    p_value: Figure = Field(description="probability of such a gain by chance, 0 to 1", examples=[1e-12])
    explanation: str = Field(
        description="what it is, in an operator's words",
        examples=["A torque over the position that no effect of the catalogue explains."],
    )
    file: str = Field(
        description="the effect as a file that an experiment can name under `effects`, YAML",
        examples=["name: learned-position-j3\ncolumns: [...]\n"],
    )


class JointDiagnosis(Part):
    """What is missing on one joint."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    verdict: Verdict = Field(description="what is left of the error", examples=["missing"])
    missing: tuple[str, ...] = Field(
        description="effects to add, the strongest first", examples=[["load-friction-asymmetric"]]
    )
    candidates: tuple[Candidate, ...] = Field(description="every effect beside the model, the best first")
    evidence: tuple[Candidate, ...] = Field(
        description="the missing effects again, each beside the model with all the others"
    )
    where: tuple[Where, ...] = Field(description="where the error sits, the most striking first")
    noise_floor: Figure = Field(
        description="relative error that noise alone would leave, from what the model with the missing effects leaves of "
        "repeated motion; null without repeats",
        examples=[0.031],
    )
    noise_floor_interval: tuple[float, float] | None = Field(
        default=None,
        description="of the noise floor, 95 %; null where there is none",
        examples=[[0.029, 0.033]],
    )
    structure: tuple[LeftoverStructure, ...] = Field(description="what could still be predicted of the error")
    superfluous: tuple[str, ...] = Field(
        description="effects of the model that do not help", examples=[["offset"]]
    )
    probability_adequate: Figure = Field(
        default=None,
        description="that what is left is noise, 0 to 1; null where not computed",
        examples=[0.01],
    )
    probability_unexplained: Figure = Field(
        default=None,
        description="that something is left that no catalogue effect explains, 0 to 1; null where not computed",
        examples=[0.02],
    )
    learned: Learned | None = Field(
        default=None, description="a description of the rest, where one is offered"
    )

    def candidate(self, effect: str) -> Candidate | None:
        """The candidate of that name; None where it was not tried."""
        return next((each for each in self.candidates if each.effect == effect), None)


class NotApplicable(Part):
    """An effect that these data cannot show."""

    effect: str = Field(description="name in the catalogue", examples=["friction-temperature"])
    joint: str = Field(description="name of the joint", examples=["j3"])
    reason: str = Field(description="what is lacking", examples=["it needs a temperature column"])


class DiagnosisDocument(Document):
    """The document of `coulomb diagnose --json`: what a model misses."""

    MADE_BY = "coulomb diagnose --json"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="as requested", examples=["usual"])
    relative_error: Figure = Field(
        description="‖Y − Wχ‖ / ‖Y‖ of the model, part of the measured torque", examples=[0.0733]
    )
    relative_error_with_missing: Figure = Field(
        description="the same with all missing effects added", examples=[0.0484]
    )
    noise_floor: Figure = Field(
        description="relative error that noise alone would leave; null where a joint's is not known",
        examples=[0.031],
    )
    joints: tuple[JointDiagnosis, ...] = Field(description="what is missing on each joint")
    not_applicable: tuple[NotApplicable, ...] = Field(description="effects that these data cannot show")
    motion: tuple[EffectOnMotion, ...] | None = Field(
        default=None,
        description="what each missing effect does to the prediction of motion that no fit saw, one added after the other; null"
        " where it was not asked for",
    )
    remarks: tuple[str, ...] = Field(
        default=(), description="what the reader must know of the record", examples=[[]]
    )

    def joint(self, name: str) -> JointDiagnosis | None:
        """The diagnosis of that joint; None where there is none of that name."""
        return next((each for each in self.joints if each.joint == name), None)
