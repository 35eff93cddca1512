"""A plan driven without and with the model's feedforward torque: the document of `coulomb compensate --json`."""

from typing import Literal

from pydantic import Field

from identify.results.document import Document, Figure, Part


class FollowingPart(Part):
    """Following errors in a part of the motion, root mean squares."""

    where: str = Field(description="in words", examples=["below 10 % of the top speed"])
    samples: int = Field(description="cycles in both drives of the plan", examples=[812])
    rms_without: Figure = Field(description="rad or m, without feedforward torque", examples=[7.6e-5])
    rms_with: Figure = Field(description="rad or m, with it", examples=[1.9e-5])


class JointFollowing(Part):
    """Following errors of one joint, over the cycles that both drives of the plan have."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    unit: Literal["rad", "m"] = Field(description="of the errors", examples=["rad"])
    rms_without: Figure = Field(description="root mean square without feedforward torque", examples=[7.6e-5])
    rms_with: Figure = Field(description="with it", examples=[1.9e-5])
    peak_without: Figure = Field(description="magnitude, without", examples=[2.9e-4])
    peak_with: Figure = Field(description="magnitude, with it", examples=[1.7e-4])
    largest_offset: Figure = Field(description="A, magnitude of what was sent", examples=[10.5])
    bounded: Figure = Field(
        description="part of the plan in which the share of the current limit was less than the model asked for",
        examples=[0.0],
    )
    speeds: tuple[FollowingPart, ...] = Field(description="by speed")
    quadrants: tuple[FollowingPart, ...] = Field(description="driving and driven by its load")


class CompensationDocument(Document):
    """The document of `coulomb compensate --json`: does the model make this machine follow better?"""

    MADE_BY = "coulomb compensate --json"

    experiment: str = Field(description="the model's", examples=["rx130l-joint3"])
    rig: str = Field(description="name of the rig", examples=["rx130l-joint3-simulated"])
    payload: str = Field(description="what was carried", examples=["disk-3.5"])
    model: str = Field(description="as it was asked for", examples=["load-velocity"])
    add: tuple[str, ...] = Field(default=(), description="effects added to it", examples=[["stribeck@j3"]])
    part: Literal["whole", "friction"] = Field(description="what of the model was sent as feedforward")
    share: float = Field(description="of the current limit, the bound of what is sent", examples=[0.5])
    recording_without: str = Field(
        description="recording without feedforward torque", examples=["session-00.h5"]
    )
    recording_with: str | None = Field(
        description="recording with it; null where nothing was recorded", examples=["session-01.h5"]
    )
    completed: bool = Field(description="whether the plan was driven to its end with feedforward torque")
    reason: str = Field(description="why the second drive of the plan ended")
    following_limits: tuple[float, ...] = Field(
        description="rad or m by joint: following error at which the second drive of the plan was to be stopped",
        examples=[[0.003]],
    )
    joints: tuple[JointFollowing, ...] = Field(
        description="of each joint; none where nothing can be compared"
    )
    folder: str = Field(
        description="inside the experiment's, where recordings and this document are",
        examples=["compensation/00"],
    )
    operator: str | None = Field(
        default=None, description="who asked for it; null in documents before it was kept"
    )
    created: str | None = Field(default=None, description="ISO 8601, UTC, when it was asked for")
    held_by: Literal["drive", "this computer"] = Field(
        default="drive",
        description="whose position loop held the axes in both runs; `this computer` in cyclic torque mode (0x6071), where the"
        " result is of that loop over the bus and not of the drive's own",
    )
    remarks: tuple[str, ...] = Field(description="what the reader must know")
