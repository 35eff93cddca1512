"""Drive profiles: which object of a drive is its position and its current reference, and in which unit.

CiA 402 names an object for everything, but drives differ in which of them they really update, in which scale,
and with which sign. A profile is a YAML file in `config/drives/` that says so, with the manual's name and
section for each object. Without one, `GENERIC` applies: position 0x6064 in counts, torque demand 0x6074 in
per mille of the rated torque 0x6076.
"""

from importlib.resources import as_file, files
from pathlib import Path
from typing import Literal

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from drivers.compensation_objects import CompensationObjects
from drivers.errors import DriverError
from drivers.first_fault import first_fault
from drivers.object_kinds import OBJECT_KINDS, ObjectType
from drivers.servo_objects import ServoObjects

Unit = Literal["count", "A", "V", "N m", "rated current", "rated torque", "°C"]


class ObjectReference(BaseModel):
    """One object of the dictionary and what its raw value means: value = sign · scale · raw [· rated
    value].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    index: int = Field(ge=0x1000, le=0xFFFF, description="index, e.g. 0x6064")
    subindex: int = Field(default=0, ge=0, le=0xFF)
    type: ObjectType = Field(description="type of the raw value")
    scale: float = Field(default=1.0, gt=0, description="unit per raw count")
    sign: Literal[-1, 1] = Field(default=1, description="-1 where the drive counts the other way")
    unit: Unit = Field(description="unit of scale · raw")
    source: str = Field(default="", description="manual's name and section, or how else it is known")

    @property
    def kind(self) -> str:
        """NumPy's name of the type, little-endian."""
        return OBJECT_KINDS[self.type]

    @property
    def bits(self) -> int:
        """Length of the raw value in bits, as in a PDO mapping entry."""
        return np.dtype(self.kind).itemsize * 8

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex:02X}"


class DriveProfile(BaseModel):
    """What is particular to a family of drives."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    vendor_id: int | None = Field(default=None, description="0x1018:01 of these drives; checked when given")
    object_dictionary: str = Field(default="generic-cia402.eds", description="EDS or DCF file")
    manuals: tuple[str, ...] = Field(default=(), description="the documents that the sources below name")
    remarks: tuple[str, ...] = Field(
        default=(), description="what could not be checked, and on what it was assumed"
    )
    position: ObjectReference = Field(description="actual position")
    current_reference: ObjectReference = Field(description="what the paper calls v: the current reference")
    rated: ObjectReference | None = Field(
        default=None,
        description="rated torque or current that a current reference in fractions refers to, where the drive tells it; else "
        "the rig file alone says it",
    )
    temperature: ObjectReference | None = Field(
        default=None, description="drive's or motor's temperature, if any"
    )
    homed_bit: int | None = Field(
        default=None,
        ge=0,
        le=15,
        description="bit of the statusword that says, in any mode, that the position refers to home; without one, bit 12 "
        "(homing attained) is looked at in homing mode",
    )
    homed_source: str = Field(default="", description="where that bit is from")
    compensation: CompensationObjects | None = Field(
        default=None, description="the drive's own compensation of friction and cogging, if it can be written"
    )
    servo: ServoObjects | None = Field(
        default=None, description="the gains of the drive's own position controller, if they can be read"
    )
    transmit_pdos: int = Field(default=4, ge=1, le=512, description="number of TPDOs of the drive")

    @field_validator("position")
    @classmethod
    def _position_in_counts(cls, position: ObjectReference) -> ObjectReference:
        if position.unit != "count":
            raise ValueError("position must be in counts: raw is what is recorded")
        return position

    def model_post_init(self, context: object) -> None:
        """A rated value is compared with the rig file's: it must be what the reference is a fraction of."""
        physical = {"rated current": "A", "rated torque": "N m"}.get(self.current_reference.unit)
        if self.rated is None or self.rated.unit == physical:
            return
        if physical is None:
            raise ValueError(
                "rated is for a current_reference in rated current or rated torque; leave it out, or give that unit"
            )
        raise ValueError(
            f"rated must be in {physical}, for current_reference is in {self.current_reference.unit}"
        )


GENERIC = DriveProfile(
    name="generic-cia402",
    manuals=("CiA 402-2 (IEC 61800-7-201): power drive systems, profile specification",),
    position=ObjectReference(
        index=0x6064, type="int32", unit="count", source="CiA 402-2, position actual value"
    ),
    current_reference=ObjectReference(
        index=0x6074, type="int16", scale=1e-3, unit="rated torque", source="CiA 402-2, torque demand"
    ),
    rated=ObjectReference(
        index=0x6076, type="uint32", scale=1e-3, unit="N m", source="CiA 402-2, motor rated torque, mN m"
    ),
)


PROFILE_ENDINGS = (".yaml", ".yml")
DICTIONARY_ENDINGS = (".eds", ".dcf")
"""In any capitals."""
_OWN_FILE = f"a file of your own is a profile ({', '.join(PROFILE_ENDINGS)}), an EDS or a DCF ({', '.join(DICTIONARY_ENDINGS)})"


class ProfileError(DriverError):
    """A profile file is wrong; one line that names file and field."""


def load_profile(name_or_path: str | Path) -> DriveProfile:
    """A profile by its name (a file of `config/drives/` without `.yaml`) or by its path.

    An EDS or DCF file stands for the generic profile of a drive with that object dictionary.

    Raises ProfileError, in one line, when there is no such profile or a field of it is wrong.
    """
    given = str(name_or_path)
    if given == GENERIC.name:
        return GENERIC
    if given.lower().endswith(DICTIONARY_ENDINGS):
        if not Path(given).is_file():
            raise ProfileError(f"{given}: there is no such file")
        return GENERIC.model_copy(update={"name": Path(given).stem, "object_dictionary": given})
    if is_path(given):
        if not given.lower().endswith(PROFILE_ENDINGS):
            raise ProfileError(f"{given}: is no drive profile; {_OWN_FILE}")
        return _parse(Path(given))
    resource = files("config") / "drives" / f"{given}.yaml"
    if not resource.is_file():
        raise ProfileError(
            f"drive profile {given!r} is not known; there are {', '.join(profile_names())}; {_OWN_FILE}"
        )
    with as_file(resource) as path:
        return _parsed(path)


def profile_files(name_or_path: str | Path) -> tuple[Path, ...]:
    """The files that a profile is read from: its own, where it has one, and its object dictionary.

    Raises ProfileError as `load_profile`.
    """
    profile, given = load_profile(name_or_path), str(name_or_path)
    software = Path(str(files("config"))) / "drives"
    named = software / profile.object_dictionary
    dictionary = named if named.is_file() else Path(profile.object_dictionary)
    if profile is GENERIC or given.lower().endswith(DICTIONARY_ENDINGS):
        return (dictionary,)
    return (Path(given) if is_path(given) else software / f"{given}.yaml", dictionary)


def is_path(drive: str) -> bool:
    """Whether a drive is named by a file of the user's own, not by a profile that comes with the software."""
    return "/" in drive or drive.lower().endswith((*PROFILE_ENDINGS, *DICTIONARY_ENDINGS))


def profile_names() -> list[str]:
    """Names of the profiles that come with the software."""
    folder = files("config") / "drives"
    named = [entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".yaml")]
    return sorted({GENERIC.name, *named})


def _parse(path: Path) -> DriveProfile:
    """A user's own profile, whose object dictionary is found beside it. One that comes with the software keeps the name of its
    dictionary, by which it is told from a drive's own (`drivers.object_dictionary.own_dictionary`)."""
    profile = _parsed(path)
    beside = path.parent / profile.object_dictionary
    if not Path(profile.object_dictionary).is_absolute() and beside.is_file():
        return profile.model_copy(update={"object_dictionary": str(beside)})
    return profile


def _parsed(path: Path) -> DriveProfile:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(f"{path}: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise ProfileError(f"{path}: not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise ProfileError(f"{path}: a drive profile is a mapping of fields")
    try:
        return DriveProfile.model_validate(content)
    except ValidationError as error:
        raise ProfileError(f"{path}: {first_fault(error)}") from error
