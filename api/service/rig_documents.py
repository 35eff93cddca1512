"""Rigs as documents: what they are, who has them, and what moves."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from identify.results.document import Json


class RigSummary(BaseModel):
    """A rig and who is at it."""

    id: str = Field(examples=["rx130l-joint3-simulated"])
    name: str | None = Field(examples=["rx130l-joint3-simulated"])
    description: str | None = Field(examples=["RX130L joint 3 on a simulated CiA 402 drive"])
    simulated: bool = Field(examples=[True])
    problem: str | None = Field(description="what is wrong with its file", examples=[None])
    operator: str | None = Field(description="who operates the rig", examples=["ada"])
    onlookers: list[str] = Field(examples=[["grace"]])


class SessionEventView(BaseModel):
    """Something that happened in a session."""

    model_config = ConfigDict(from_attributes=True)

    kind: str = Field(description="state, progress, remark or alarm", examples=["remark"])
    state: str = Field(description="the session's, after it", examples=["running"])
    words: str = Field(description="one sentence for the operator", examples=["the plan has begun"])
    # Plain values: each kind of event has fields of its own, and the page shows the words.
    data: Json = Field(examples=[{"cycle": 500, "cycles": 30000}])
    time: str = Field(description="ISO 8601, UTC", examples=["2026-11-22T15:04:05.120+00:00"])


class ActiveSessionView(BaseModel):
    """The session that has a rig's bus, or had it last."""

    experiment: str = Field(examples=["rx130l-joint3"])
    experiment_name: str = Field(examples=["rx130l-joint3"])
    id: str = Field(examples=["session-01"])
    state: str = Field(examples=["running"])
    reason: str = Field(description="why it ended so, or empty", examples=[""])
    alarm: str = Field(description="what a person must do now, or empty", examples=[""])
    fraction: float = Field(description="of the plan, 0 to 1", examples=[0.4])
    elapsed: float = Field(description="s of the rig's time", examples=[24.0])
    events: list[SessionEventView] = Field(description="the last twenty")


class RigStatus(BaseModel):
    """Who is at a rig, and what happens on it."""

    rig: str = Field(examples=["rx130l-joint3-simulated"])
    operator: str | None = Field(examples=["ada"])
    onlookers: list[str] = Field(examples=[["grace"]])
    session: ActiveSessionView | None


class BusFigures(BaseModel):
    """What the live view has seen of a bus."""

    rows: int
    """samples seen"""
    missing: int
    """values that did not come"""
    sync_period: float | None
    """s, mean over the last samples"""
    sync_jitter: float | None
    """s, standard deviation of the same"""


class LiveStatus(RigStatus):
    """The status as the live view is sent it while a session runs."""

    figures: BusFigures


class RigView(RigSummary):
    """A rig with its settings and the session that has its bus."""

    # As the file's own fields are: a client of another version reads what it knows of them.
    settings: Json = Field(
        description="the rig's file", examples=[{"name": "rx130l-joint3-simulated", "cycle": 0.002}]
    )
    drive_gain: list[list[float]] = Field(
        description="g_f of eq. (4), N m (or N) per unit of command", examples=[[[35.15]]]
    )
    status: RigStatus


class HomingView(BaseModel):
    """A homing, under way or the last one."""

    model_config = ConfigDict(from_attributes=True)

    joint: str = Field(examples=["j3"])
    method: int | None = Field(examples=[37])
    operator: str = Field(examples=["ada"])
    state: Literal["homing", "done", "stopped", "failed"] = Field(examples=["done"])
    words: str = Field(description="what was found, or why it ended", examples=["homed; is at 0.02 rad"])
    position: float | None = Field(description="rad or m, where the joint is once homed", examples=[0.02])
    within_limits: bool | None = Field(examples=[True])


class ResetJointView(BaseModel):
    """One drive after a reset."""

    model_config = ConfigDict(from_attributes=True)

    joint: str = Field(examples=["j3"])
    node: int = Field(examples=[3])
    ok: bool = Field(description="no power and no fault", examples=[True])
    words: str = Field(
        examples=["fault reset; it was 0x4310 motor or transmission too hot; now in SWITCH ON DISABLED"]
    )


class Stopped(BaseModel):
    """What the stop found."""

    stopped: bool = Field(description="false if nothing was under way", examples=[True])
