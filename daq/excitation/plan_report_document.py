"""What is to be expected of a plan, as a document: what `coulomb plan --json` prints, and what is kept of a plan beside it."""

import json

from pydantic import BaseModel, ConfigDict, Field

from daq.excitation.excitation_plan import ExcitationPlan


class _Part(BaseModel):
    """A part of the document; in JSON its keys are those of the contract."""

    model_config = ConfigDict(frozen=True, populate_by_name=True, from_attributes=True)


class RepeatedStretch(_Part):
    """A stretch in which the motion repeats exactly; s."""

    begin: float = Field(validation_alias="from", serialization_alias="from", examples=[2.5])
    end: float = Field(validation_alias="to", serialization_alias="to", examples=[52.5])
    period: float = Field(examples=[10.0])


class PlannedNoise(_Part):
    """What was planned for."""

    joint: str = Field(examples=["j3"])
    std: float = Field(description="N m or N, of the filtered torque", examples=[4.2])


class ExpectedParameter(_Part):
    """One parameter, and how well the plan will tell it."""

    name: str = Field(examples=["ZZ1R"])
    joint: str = Field(examples=["j3"])
    unit: str = Field(examples=["kg m^2"])
    effect: str | None = Field(
        description="that it belongs to; null for the rigid robot's own", examples=[None]
    )
    value: float | None = Field(description="what is known of it beforehand", examples=[30.9])
    std: float | None = Field(description="to expect; null where it is not determined", examples=[0.14])
    relative_std_percent: float | None = Field(examples=[0.46])


class NotShown(_Part):
    """Effects of one joint that the plan does not show, with the reason and what would show them."""

    joint: str = Field(examples=["j3"])
    effects: tuple[str, ...] = Field(examples=[["stribeck"]])
    reason: str = Field(examples=["it is never slow for long"])
    remedy: str = Field(examples=["make a longer plan"])


class CoveredJoint(_Part):
    """What the sessions of a plan make one joint do; shares are of the joint's moving time over all sessions."""

    joint: str = Field(examples=["j3"])
    position_range: tuple[float, float] = Field(description="rad or m", examples=[[-1.2, 1.2]])
    position_share: float = Field(description="of the range that the limits allow", examples=[0.9])
    highest_speed_share: float = Field(description="of the speed that the limits allow", examples=[0.95])
    slow_forwards: float = Field(description="at a steady, slow speed", examples=[0.1])
    slow_backwards: float = Field(examples=[0.1])
    fast: float = Field(examples=[0.3])
    quadrants: tuple[float, float, float, float] = Field(
        description="1 to 4 of (speed, load): (+, +), (−, +), (−, −), (+, −)",
        examples=[[0.25, 0.25, 0.25, 0.25]],
    )
    load_range: tuple[float, float] = Field(description="N m, as predicted", examples=[[-80.0, 80.0]])
    payload_masses: tuple[float, ...] = Field(description="kg, of the sessions", examples=[[0.0, 3.4584]])


class PeakCurrent(_Part):
    """The highest current of one joint with one payload, as predicted; A."""

    payload: str = Field(examples=["none"])
    joint: str = Field(examples=["j3"])
    current: float = Field(examples=[3.1])
    limit: float = Field(examples=[6.0])


class PlanFindings(_Part):
    """What a plan tells about a model and what it cannot."""

    rig: str = Field(examples=["rx130l-joint3-simulated"])
    model: str = Field(examples=["load-velocity"])
    criterion: str = Field(examples=["d-optimal"])
    payloads: tuple[str, ...] = Field(description="one session each", examples=[["none", "disk-3.5"]])
    seconds: float = Field(examples=[60.0])
    repeated: tuple[RepeatedStretch, ...]
    loads: str = Field(
        description="where the values come from that loads are predicted with",
        examples=["from assumed masses"],
    )
    noise: tuple[PlannedNoise, ...]
    condition_number: float | None = Field(examples=[31.2])
    parameters: tuple[ExpectedParameter, ...]
    inseparable: tuple[tuple[str, ...], ...] = Field(
        description="parameters of which the plan shows only combinations; alone: not at all",
        examples=[[["ZZ1R"]]],
    )
    cannot_tell: tuple[NotShown, ...]
    coverage: tuple[CoveredJoint, ...]
    peak_current: tuple[PeakCurrent, ...]
    remarks: tuple[str, ...] = Field(examples=[[]])


class PlanReportDocument(PlanFindings):
    """A plan and what is to be expected of it."""

    plan: ExcitationPlan

    def json_text(self) -> str:
        """As `coulomb plan --json` prints it."""
        return json.dumps(self.model_dump(mode="json", by_alias=True), ensure_ascii=False, allow_nan=False)
