"""The rig file: bus, axes and their limits, robot, payloads; for a simulated rig the plant behind the drives.

Raw counts are the truth (design, idea 2); this file holds what scales them. Units are SI in joint space
unless a field says otherwise.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

import config
from daq.json_object import JsonObject
from drivers.bus import BusSettings
from drivers.drive_gain import drive_gain, is_singular
from drivers.errors import DriverError
from drivers.profile import PROFILE_ENDINGS, DriveProfile, is_path, load_profile
from drivers.profile_against_dictionary import mismatches
from drivers.safety_output import SafetyOutputSettings
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload, check_settings
from identify.recording.plain_text import printable
from identify.recording.strict_yaml import read_strict_yaml

_LAB_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_SHOWN = 80
"""letters of a wrong name that a message shows"""


def _lab_name(name: str) -> str:
    """A name that can be typed in a command and stand in an address. Raises ValueError where it cannot."""
    if not _LAB_NAME.fullmatch(name):
        shown = printable(name if len(name) <= _SHOWN else f"{name[:_SHOWN]}…")
        raise ValueError(
            f"'{shown}': use letters without accents, digits, '_', '.' and '-', a letter or digit first, 64 at most"
        )
    return name


Name = Annotated[str, AfterValidator(_lab_name)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]

RIGS = Path(config.__file__).parent / "rigs"
"""Where rigs are looked for by name."""

_AMPERE: dict[str, tuple[str, Callable[[Any], float]]] = {
    "A": ("torque_constant", lambda axis: 1.0),
    "V": ("amplifier_gain", lambda axis: axis.amplifier_gain),
    "N m": ("torque_constant", lambda axis: 1.0 / axis.torque_constant),
    "rated current": ("rated_current", lambda axis: axis.rated_current),
    "rated torque": ("rated_torque", lambda axis: axis.rated_torque / axis.torque_constant),
}
"""By unit of a drive's current reference: what an axis must state, and the A that one unit is."""


def ampere_per_unit(axis: "Axis", unit: str) -> float:
    """A that one unit of a drive's current or torque is, by what the axis states.

    Raises InputError where the axis does not state what that takes.
    """
    field, of_axis = _AMPERE[unit]
    if getattr(axis, field) is None:
        raise InputError(
            f"axis {axis.joint}: {field} is missing; the drive {axis.drive} has values in {unit}"
        )
    return float(of_axis(axis))


def _hexadecimal(value: Any) -> Any:
    """Node ids, COB-IDs and entries of PDOs may be written as manuals write them, 0x03."""
    if isinstance(value, str) and re.fullmatch(r"0[xX][0-9a-fA-F]{1,8}", value):
        return int(value, 16)
    return value


PdoEntry = Annotated[int, BeforeValidator(_hexadecimal), Field(ge=0x10000000, le=0xFFFFFFFF)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Joint(_Settings):
    """One joint in modified Denavit-Hartenberg parameters (Khalil-Kleinfinger), frame j in frame j-1."""

    name: Name
    type: Literal["revolute", "prismatic"] = "revolute"
    alpha: Finite = 0.0
    """rad"""
    d: Finite = 0.0
    """m"""
    theta: Finite = 0.0
    """rad; the constant offset added to q of a revolute joint"""
    r: Finite = 0.0
    """m; the constant offset added to q of a prismatic joint"""


class Robot(_Settings):
    """The robot's geometry, base to tip."""

    gravity: Vector3 = (0.0, 0.0, -9.81)
    """m/s², in the base frame"""
    joints: tuple[Joint, ...] = Field(min_length=1)


class Limits(_Settings):
    """What an axis may do. Checked on a plan before it runs and on every sample while it runs."""

    position: tuple[Finite, Finite]
    """rad or m: lowest, highest joint position"""
    velocity: Positive
    """rad/s or m/s"""
    acceleration: Positive
    """rad/s² or m/s²"""
    jerk: Positive
    """rad/s³ or m/s³"""
    quick_stop_deceleration: Positive | None = None
    """rad/s² or m/s²: the least with which the drive's quick stop (0x6085) slows the axis; half of `acceleration` where left
    out. An axis that is slower to stop is cut off from power"""
    current: Positive
    """A, magnitude of the current reference"""
    following_error: Positive
    """rad or m, between setpoint and position"""
    temperature: Positive | None = None
    """°C; needs a drive that reports one"""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.position[0] < self.position[1]:
            raise ValueError(
                f"position: the lowest, {self.position[0]}, must lie below the highest, {self.position[1]}"
            )
        return self


class Axis(_Settings):
    """One drive: where it is on the bus and how its raw numbers become SI units."""

    joint: Name
    """the joint of the robot that this drive moves"""
    node: Annotated[int, BeforeValidator(_hexadecimal), Field(ge=1, le=127)]
    """CANopen node id"""
    drive: Annotated[str, Field(min_length=1, max_length=4096)] = "generic-cia402"
    """the drive's profile in config/drives, or a profile or EDS file, relative to the rig file"""
    encoder_counts: Positive
    """counts per turn of the motor (for 0x6064), as the drive counts them"""
    gear_ratio: Finite = 1.0
    """motor turns per joint turn (rad of motor per m for a prismatic joint), signed; N of eq. (4)"""
    torque_constant: Positive
    """N m/A at the motor's shaft, K_t of eq. (4)"""
    amplifier_gain: Positive | None = None
    """A/V, G_i of eq. (4); where the command is the input of an analogue amplifier"""
    rated_current: Positive | None = None
    """A; where the drive's profile gives the command as a fraction of the rated current"""
    rated_torque: Positive | None = None
    """N m at the motor's shaft (0x6076); where the profile gives the command as a fraction of it"""
    mode: Literal["cyclic-synchronous-position", "interpolated-position"] = "cyclic-synchronous-position"
    """mode of operation in which the axis follows the setpoints"""
    feedforward: Literal["torque-offset", "cyclic-torque"] = "torque-offset"
    """how a proof (`coulomb compensate`) sends a model's torque: beside the target position, where the drive's own loops hold the
    axis (0x60B2); or as target torque of mode 10 (0x6071), where this computer's loop holds it over the bus"""
    held_by: Literal["brake", "balance"] | None = None
    """what holds the axis against gravity without power; `feedforward: cyclic-torque` is refused where gravity acts and nothing
    is stated"""
    homing: Literal["absolute-encoder", "drive"] = "absolute-encoder"
    """whether the drive must have been homed (mode 6) for its counts to mean anything"""
    home: Finite = 0.0
    """rad or m: joint position at which the drive counts zero"""
    limits: Limits
    logged_pdos: (
        dict[Annotated[int, BeforeValidator(_hexadecimal), Field(ge=1, le=0x7FF)], tuple[PdoEntry, ...]]
        | None
    ) = None
    """for `coulomb import LOG --rig` only: how the drive was mapped by another master, where neither the log's SDO traffic nor a
    DCF tells it; by COB-ID the entries as 0x1A00 and 0x1600 hold them, e.g. 0x1C3: [0x60410010, 0x60640020]"""

    @model_validator(mode="after")
    def _geared(self) -> Self:
        if self.gear_ratio == 0:
            raise ValueError("gear_ratio must not be 0")
        return self


class Supervision(_Settings):
    """How the samples are watched during motion."""

    window: Positive = 0.02
    """s over which velocity and acceleration of the samples are measured"""
    velocity_margin: Annotated[float, Field(ge=1, le=2)] = 1.1
    """a sample may exceed the velocity limit by this factor: the plan uses the limit, the axis overshoots it"""
    acceleration_margin: Annotated[float, Field(ge=1, le=10)] = 2.0
    """likewise for the acceleration, where a breakaway from stiction shows"""
    silence: Positive = 0.05
    """s without any position from a drive, or without SYNC, until the motion is stopped"""
    heartbeat_period: Positive = 0.1
    """s between heartbeats, the drives' and ours"""
    heartbeat_timeout: Positive = 0.5
    """s without a heartbeat until a node counts as lost"""
    parent_timeout: Positive = 1.4
    """s without a sign of life from the process that holds the stop button until the motion is stopped; with the ramp after it
    2.2 s at most until the axes rest (`daq.stopping_watch.longest_stop`)"""
    torque_timeout: Positive = 0.02
    """s without a torque setpoint until a drive in cyclic torque mode stops by itself (0x1400:05); we stop it too when positions
    have come too late for as long"""
    stop_timeout: Positive = 5.0
    """s that an axis may take to come to rest"""
    approach_speed: Annotated[float, Field(gt=0, le=1)] = 0.3
    """share of the limits with which the axes move to where the plan begins"""


class Storage(_Settings):
    """How the samples come to disk."""

    flush_interval: Positive = 0.25
    """s; what a killed recorder can lose"""
    sync_interval: Positive = 1.0
    """s; what a power cut can lose"""
    disk_reserve: float = Field(default=200.0, ge=0)
    """MB that must stay free; below, the motion is stopped"""


def with_lab_name(payload: Payload) -> Payload:
    """A payload as a rig, a form or a request may name one: its name can be typed in a command and stand in an address.

    Raises ValueError where it cannot.
    """
    try:
        _lab_name(payload.name)
    except ValueError as error:
        raise ValueError(f"name: {error}") from None
    return payload


class Rig(_Settings):
    """A robot joint (or six) behind drives on one bus."""

    name: Name
    description: str = ""
    cycle: float = Field(ge=0.0005, le=0.1)
    """s, from one SYNC to the next"""
    pacing: Literal["real-time", "as-fast-as-answered"] = "real-time"
    """`as-fast-as-answered` is for simulated drives only: the next SYNC follows the last answer"""
    bus: BusSettings = BusSettings()
    robot: Robot
    axes: tuple[Axis, ...] = Field(min_length=1)
    """one per joint, in the order of the joints"""
    gear_matrix: tuple[tuple[Finite, ...], ...] | None = None
    """n x n, motor velocities = gear_matrix @ joint velocities; for coupled axes, instead of gear ratios"""
    payloads: tuple[Annotated[Payload, AfterValidator(with_lab_name)], ...] = (
        Payload(name="none", mass=0.0),
    )
    supervision: Supervision = Supervision()
    storage: Storage = Storage()
    safety_output: SafetyOutputSettings | None = None
    """an output that takes the drives' power away when they do not obey; nothing where left out"""
    record_temperature: bool = False
    """whether the drives' temperature travels in a PDO of its own and is recorded"""
    simulated: JsonObject | None = None
    """only for a simulated rig: the plant, its hidden effects and the drives' faults (`drivers.simulated`)"""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        joints = [joint.name for joint in self.robot.joints]
        if len(set(joints)) != len(joints):
            raise ValueError(f"robot.joints: two joints have the same name ({', '.join(joints)})")
        driven = [axis.joint for axis in self.axes]
        if driven != joints:
            raise ValueError(
                f"axes must name one drive for each joint in the robot's order ({', '.join(joints)}), "
                f"not ({', '.join(driven)})"
            )
        nodes = [axis.node for axis in self.axes]
        if len(set(nodes)) != len(nodes):
            raise ValueError(f"axes: two drives have the same node id ({', '.join(map(str, nodes))})")
        names = [payload.name for payload in self.payloads]
        if len(set(names)) != len(names):
            raise ValueError(f"payloads: two have the same name ({', '.join(names)})")
        if self.gear_matrix is not None:
            n = len(joints)
            if len(self.gear_matrix) != n or any(len(row) != n for row in self.gear_matrix):
                raise ValueError(f"gear_matrix must have {n} rows of {n} numbers")
            if is_singular(np.array(self.gear_matrix, dtype=float)):
                raise ValueError("gear_matrix cannot be inverted: some joint is not driven")
        if len({axis.feedforward for axis in self.axes}) > 1:
            raise ValueError("axes: feedforward must be the same for all axes, for they are driven together")
        if self.held_over_the_bus and self.supervision.torque_timeout < 2 * self.cycle:
            raise ValueError(
                f"supervision.torque_timeout: two cycles at least ({2 * self.cycle:g} s), else a drive in torque mode stops"
                " between two setpoints"
            )
        for index, (axis, profile) in enumerate(zip(self.axes, self.profiles, strict=True)):
            unit = profile.current_reference.unit
            if getattr(axis, _AMPERE[unit][0]) is None:
                raise ValueError(
                    f"axes[{index}]: {_AMPERE[unit][0]} is missing; the drive {axis.drive} gives its current "
                    f"reference in {unit}"
                )
            wrong = mismatches(profile, axis.node)
            if wrong:
                raise ValueError(f"axes[{index}].drive: {wrong[0]}")
        if self.pacing == "as-fast-as-answered" and self.simulated is None:
            raise ValueError("pacing: as-fast-as-answered is for simulated rigs; real drives need real-time")
        return self

    @property
    def held_over_the_bus(self) -> bool:
        """Whether a proof takes the drives' position loops out and closes one here (`feedforward: cyclic-torque`)."""
        return self.axes[0].feedforward == "cyclic-torque"

    @property
    def motor_gear(self) -> NDArray[np.float64]:
        """N (n, n) of eq. (4): motor velocities = N @ joint velocities."""
        if self.gear_matrix is not None:
            return np.array(self.gear_matrix, dtype=float)
        return np.diag([axis.gear_ratio for axis in self.axes]).astype(float)

    @property
    def profiles(self) -> tuple[DriveProfile, ...]:
        """(n) the axes' drive profiles.

        Raises ProfileError when one is not known.
        """
        return tuple(load_profile(axis.drive) for axis in self.axes)

    @property
    def command_scale(self) -> NDArray[np.float64]:
        """(n,) A per raw count of the current reference: recorded commands are in A, whatever the drive counts.

        G_i of eq. (4) is in here where the drive's command is the input of an analogue amplifier.
        """
        return np.array(
            [
                profile.current_reference.sign
                * profile.current_reference.scale
                * _AMPERE[profile.current_reference.unit][1](axis)
                for axis, profile in zip(self.axes, self.profiles, strict=True)
            ]
        )

    @property
    def drive_gain(self) -> NDArray[np.float64]:
        """g_f (n, n) of eq. (4), N m/A (or N/A): joint torque = g_f @ command."""
        return drive_gain(self.motor_gear, "A", torque_constant=[axis.torque_constant for axis in self.axes])

    @property
    def position_matrix(self) -> NDArray[np.float64]:
        """(n, n) rad (or m) per encoder count: position = position_matrix @ counts + position_offset."""
        radians_per_count = np.array([2 * np.pi / axis.encoder_counts for axis in self.axes])
        return np.asarray(np.linalg.inv(self.motor_gear) * radians_per_count, dtype=np.float64)

    @property
    def position_offset(self) -> NDArray[np.float64]:
        """(n,) rad or m: joint position where every drive counts zero."""
        return np.array([axis.home for axis in self.axes])

    def payload(self, name: str) -> Payload:
        """The payload of that name.

        Raises InputError when the rig has none of that name.
        """
        for payload in self.payloads:
            if payload.name == name:
                return payload
        known = ", ".join(payload.name for payload in self.payloads)
        raise InputError(f"rig {self.name}: payload {name!r} is not known; known are {known}")

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Read a rig from a file, or by name from config/rigs.

        Raises InputError with one line that names the file and the field.
        """
        path = rig_file(source)
        document, lines = read_strict_yaml(path)
        _resolve_drives(document, path.parent)
        try:
            return check_settings(cls, document, lines, path)
        except DriverError as error:
            raise InputError(f"{path}: {error}") from None


def rig_file(source: str | Path) -> Path:
    """The file of a rig that is named by its file, or by its name in config/rigs. Raises InputError where no rig has the name."""
    path = Path(source)
    if path.suffix.lower() in PROFILE_ENDINGS:
        return path
    path = RIGS / f"{source}.yaml"
    if not path.is_file():
        known = ", ".join(rig_names()) or "none"
        raise InputError(f"rig {str(source)!r} is not known; known are {known}")
    return path


def _resolve_drives(document: Any, folder: Path) -> None:
    """Drives that are named by files are found beside the rig file, wherever the command is run."""
    try:
        axes: list[JsonObject] = [axis for axis in document["axes"] if isinstance(axis, dict)]
    except (TypeError, KeyError):
        return  # said when the fields are checked
    for axis in axes:
        drive = axis.get("drive")
        if isinstance(drive, str) and is_path(drive) and not Path(drive).is_absolute():
            axis["drive"] = str((folder / drive).resolve())


def rig_names() -> list[str]:
    """Names of the rigs in config/rigs."""
    return sorted(path.stem for path in RIGS.glob("*.yaml"))
