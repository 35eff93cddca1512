"""How well a model predicts motion: the document of `coulomb simulate --json`."""

from typing import Literal

from pydantic import Field

from identify.results.document import Document, Figure, Part
from identify.results.effect import EffectOnJoint
from identify.results.unseen_motion import UnseenMotionErrors

HORIZONS = (0.1, 1.0)
"""s, where none is asked for: a controller's look ahead, and a move"""


class JointMotionError(Part):
    """How far the simulated motion of a joint is from the measured one; root mean squares over all samples."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    position_rms: Figure = Field(description="rad or m", examples=[0.0015])
    velocity_rms: Figure = Field(description="rad/s or m/s", examples=[0.0036])
    unit: Literal["rad", "m"] = Field(description="of the position", examples=["rad"])
    windows: int = Field(description="how many windows the figures are of", examples=[60])
    left_record_at: Figure = Field(
        description="s into the session at which the free run was first a tenth of the joint's range of motion off; null"
        " for windows, and where it never was",
        examples=[None],
    )
    position_rms_usual: Figure = Field(
        default=None,
        description="rad or m, of the usual model (eq. 8) on the same windows; null where the model is the usual one",
    )
    velocity_rms_usual: Figure = Field(default=None, description="rad/s or m/s, likewise")
    left_record_at_usual: Figure = Field(
        default=None, description="s into the session at which the usual model left the record, likewise"
    )


class SessionMotionError(Part):
    """The errors in one session."""

    file: str = Field(description="the session's file", examples=["session-00.csv"])
    payload: str = Field(description="what was carried", examples=["none"])
    joints: tuple[JointMotionError, ...] = Field(description="errors of each joint")


class HorizonErrors(Part):
    """Errors at one horizon, in the sessions of one role."""

    horizon: Figure = Field(description="s; null is the free run from the record's start", examples=[1.0])
    role: Literal["identification", "validation"] = Field(description="of the sessions")
    joints: tuple[JointMotionError, ...] = Field(description="errors of each joint, sessions together")
    sessions: tuple[SessionMotionError, ...] = Field(description="errors of each session")
    energy_drift: Figure = Field(
        description="by how much kinetic and potential energy depart from the work done, in parts of the work: a figure of"
        " the integration, not of the model; null where the model has no rigid robot of its own",
        examples=[1e-5],
    )
    simulated_seconds: float = Field(description="s of motion, all windows together", examples=[60.0])


class ControllerGains(Part):
    """The controller that closes the loop on one joint; the command's unit is that of the record."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    position: float = Field(description="command per rad or m of position error")
    velocity: float = Field(description="command per rad/s or m/s of measured speed")
    reference_velocity: float = Field(description="command per rad/s or m/s of the reference's speed")
    reference_acceleration: float = Field(
        default=0.0, description="command per rad/s² or m/s² of the reference's acceleration"
    )
    reference_travel: float = Field(
        default=0.0, description="command per rad or m that the reference has moved since the beginning"
    )
    integral: float = Field(description="command per rad s or m s of the error's integral")
    offset: float = Field(description="command")
    limit: Figure = Field(description="largest command either way; null where there is none")


class ControllerUsed(Part):
    """The controllers that a simulation closed the loop with."""

    source: Literal["file", "estimated", "drives"] = Field(
        description="where the gains come from: a file, the record, or the drives, which were asked before the sessions"
    )
    coordinates: Literal["joints", "motors"] = Field(
        default="joints",
        description="what each controller sees: its joint, or its motor in units of its joint, where motors share joints",
    )
    read_from: tuple[str, ...] = Field(
        default=(), description="objects of the drives that the gains were read from, with what they held"
    )
    joints: tuple[ControllerGains, ...] = Field(description="gains of each joint")


Formed = Literal["instant", "state", "give", "command", "left-out"]
"""how a simulation forms an effect's torque"""


class EffectInSimulation(Part):
    """How a simulation forms an effect's torque."""

    effect: str = Field(description="name of the effect", examples=["elasticity"])
    joint: str = Field(description="name of the joint", examples=["j3"])
    formed: Formed = Field(
        description="from position, speed, load and inputs of the instant; with a state of its own; as a give between motor and"
        " link, whose motions are states apart; as a shift of the recorded command in time; or left out, as that shift is in"
        " closed loop"
    )
    state: str | None = Field(
        description="what the state is; null where there is none", examples=["position and speed of the link"]
    )


class SimulationDocument(Document):
    """The document of `coulomb simulate --json`: errors of simulated motion, by horizon and role."""

    MADE_BY = "coulomb simulate --json"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="as it was asked for", examples=["usual"])
    effects: tuple[EffectOnJoint, ...] = Field(description="of the model")
    controller: ControllerUsed | None = Field(description="null where the recorded torque drives the model")
    horizons: tuple[HorizonErrors, ...] = Field(description="shortest first, the free run last")
    along_record: tuple[EffectOnJoint, ...] = Field(
        default=(),
        description="effects whose torque was taken along the measured motion; none since effects with a memory are states",
    )
    formed: tuple[EffectInSimulation, ...] = Field(
        default=(), description="how the torque of each effect was formed"
    )
    inputs: tuple[str, ...] = Field(
        default=(),
        description="what of the record after their start the simulations were given. The measured motion gives the"
        " state at the start alone, whose speed is filtered from rows to either side",
        examples=[["recorded torque"]],
    )
    unseen: UnseenMotionErrors | None = Field(
        default=None,
        description="windows of a second in motion that the fit did not see, driven by the recorded torque; null where no session"
        " is long enough",
    )
    remarks: tuple[str, ...] = Field(description="what the reader must know")
