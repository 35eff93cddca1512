"""In what a simulated drive differs from what masters expect, as real ones do."""

import re
from collections.abc import Iterator
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field


def _address(text: str) -> str:
    if not re.fullmatch(r"0x[0-9A-Fa-f]{4}(:[0-9A-Fa-f]{2})?", text):
        raise ValueError(
            "give 0x and the four hexadecimal digits of an index, such as 0x60C2, or 0x60C2:02 with a subindex"
        )
    return text


Address = Annotated[str, AfterValidator(_address)]
"""0x60C2 for an object with all its subindices, 0x60C2:02 for one of them"""

PDOS = 4
"""PDOs of each direction in the EDS of the simulated drive"""


def named(addresses: tuple[str, ...], index: int, subindex: int) -> bool:
    """Whether an object is among those that are named by address."""
    return any(
        int(name[2:6], 16) == index and (len(name) == 6 or int(name[7:], 16) == subindex)
        for name in addresses
    )


class OdditySettings(BaseModel):
    """Oddities of one drive; none by default."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    fixed_pdos: bool = Field(
        default=False,
        description="PDO mappings and communication parameters can only be read: TPDO 1 statusword and position, TPDO 2 "
        "torque demand and actual torque, RPDO 1 controlword, mode and target position",
    )
    no_heartbeat_consumer: bool = Field(default=False, description="there is no object 0x1016")
    node_guarding_only: bool = Field(
        default=False,
        description="there is neither 0x1016 nor 0x1017: the drive is guarded by remote frames (0x100C, 0x100D)",
    )
    toggles: bool = Field(
        default=True, description="whether answers to node guarding change their toggle bit, as they have to"
    )
    receive_pdos: int = Field(default=PDOS, ge=1, le=PDOS, description="number of RPDOs")
    fixed_interpolation: int | None = Field(
        default=None, ge=1, le=255, description="ms that 0x60C2 holds, which then can only be read"
    )
    missing: tuple[Address, ...] = Field(default=(), description="objects that the drive does not have")
    read_only: tuple[Address, ...] = Field(default=(), description="objects that can only be read")
    holds: dict[Address, int] = Field(
        default={}, description="values of objects; one that is not in the EDS becomes an UNSIGNED32"
    )
    boots_after: float = Field(
        default=0.0,
        ge=0,
        le=600,
        description="s from an NMT reset to the boot-up; the drive is deaf until then",
    )
    answers_after: float = Field(default=0.0, ge=0, le=1, description="s until an SDO is answered")
    shows_state_after: int = Field(
        default=0,
        ge=0,
        le=1000,
        description="statuswords that are sent as they were, after each change of it",
    )

    def lacks(self, index: int, subindex: int) -> bool:
        """Whether the drive does not have an object that is in the EDS."""
        return (
            any(first + self.receive_pdos <= index < first + PDOS for first in (0x1400, 0x1600))
            or (index == 0x1016 and (self.no_heartbeat_consumer or self.node_guarding_only))
            or (index == 0x1017 and self.node_guarding_only)
            or named(self.missing, index, subindex)
        )

    def refuses(self, index: int, subindex: int) -> bool:
        """Whether an object can only be read that could be written by the EDS."""
        is_pdo = any(first <= index < first + PDOS for first in (0x1400, 0x1600, 0x1800, 0x1A00))
        return (
            (self.fixed_pdos and is_pdo)
            or (self.fixed_interpolation is not None and index == 0x60C2)
            or named(self.read_only, index, subindex)
        )

    def fixed_pdo_objects(self, node: int) -> Iterator[tuple[int, int, int]]:
        """Index, subindex and value of the PDOs that can only be read; nothing where they can be written."""
        if not self.fixed_pdos:
            return
        for communication, mapping, base, entries in (
            (0x1800, 0x1A00, 0x180, (0x60410010, 0x60640020)),
            (0x1801, 0x1A01, 0x280, (0x60740010, 0x60770010)),
            (0x1400, 0x1600, 0x200, (0x60400010, 0x60600008, 0x607A0020)),
        ):
            yield communication, 1, base + node
            yield communication, 2, 1
            for subindex, value in enumerate((len(entries), *entries)):
                yield mapping, subindex, value
