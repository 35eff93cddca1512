"""An identified model without its record: the document of `coulomb export EXPERIMENT TARGET.json`."""

from pydantic import Field

from identify.results.document import Document, Part


class ExportedLink(Part):
    """One joint and its link. Modified Denavit-Hartenberg frames (Khalil-Kleinfinger); SI units."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    prismatic: bool = Field(description="whether the joint slides")
    alpha: float = Field(description="rad")
    d: float = Field(description="m")
    theta: float = Field(description="rad, added to the position of a revolute joint")
    r: float = Field(description="m, added to the position of a prismatic joint")
    standard: tuple[float, ...] = Field(
        description="XX XY XZ YY YZ ZZ MX MY MZ M Ia about the link's frame; one choice of many with the same torques"
    )


class ExportedBaseParameter(Part):
    """One identified base parameter."""

    name: str = Field(description="symbol", examples=["ZZ1R"])
    grouping: str = Field(description="standard parameters that it is made of", examples=["ZZ1 + Ia1"])
    value: float = Field(description="in `unit`")
    unit: str = Field(description="of `value`", examples=["kg m^2"])


class ExportedTorque(Part):
    """A torque of one effect on one joint: the sum of values times formulas.

    Formulas are of q, dq, ddq, direction (sign of dq), load (tau_out of eq. 6), torque (load and all friction before),
    t, temp, memory (state of presliding, or place in a gap), load_slope (derivative of load over q of the joint itself),
    gravity_1 and gravity_2 (load at rest per m/s² of gravity along the two directions of `across`),
    motor_velocity, motor_acceleration, motor_load (the inverse of `motor_shares` times the joints' loads) and motor_share of
    `motor`, or of a motor that turns as `turns` says. The sum is differentiated over time as often as `derivative` says.
    """

    effect: str = Field(description="name of the effect", examples=["viscous"])
    joint: str = Field(description="that it acts on")
    motor: str = Field(description="joint whose motor owns it")
    formulas: tuple[str, ...] = Field(description="of the signals above, SI", examples=[["dq"]])
    values: tuple[float, ...] = Field(description="N m or N per unit of the formula")
    presliding_distance: float | None = Field(
        description="rad or m, of an effect whose memory fades towards the direction of travel, from -1 to 1"
    )
    play: float | None = Field(
        default=None,
        description="rad or m: width of the gap, of an effect whose memory is the link's place in it, from -0.5 to 0.5, moved"
        " against the travel",
    )
    turns: tuple[float, ...] | None = Field(
        default=None,
        description="of a motor that no gain matrix declares: its velocity is the sum of these times the joints' velocities, and"
        " its share on `joint` is that joint's number here",
    )
    derivative: int = Field(default=0, description="how many times the sum is differentiated over time")


class ExportedModelDocument(Document):
    """The model as data, for programs of one's own."""

    MADE_BY = "coulomb export"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="the model, as requested", examples=["usual"])
    gravity: tuple[float, float, float] = Field(description="m/s², in the base frame")
    across: tuple[tuple[float, float, float], tuple[float, float, float]] | None = Field(
        default=None,
        description="two directions across gravity in the base frame, of a base that is not level: what `gravity_1` and"
        " `gravity_2` of formulas are along",
    )
    links: tuple[ExportedLink, ...] = Field(description="base to tip")
    base: tuple[ExportedBaseParameter, ...] = Field(description="base parameters, as identified")
    motor_shares: tuple[tuple[float, ...], ...] = Field(
        description="motor velocities are the transpose of this times joint velocities"
    )
    torques: tuple[ExportedTorque, ...] = Field(description="friction and all else beside the rigid robot")
