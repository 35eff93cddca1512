"""The CAN bus: which interface, and how to open it with errors that say what to do.

Every interface that python-can knows can be named: `socketcan` on Linux, `slcan` for USB adapters that speak
the serial-line protocol, `virtual` for nodes inside this process, and the vendors' own.
"""

import json
from pathlib import Path
from typing import Any

import can
from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers import gateway
from drivers.errors import BusError, reason_in_words
from drivers.virtual_bus import InProcessBus

NETWORK_CLASSES = Path("/sys/class/net")
_INTERFACE_UP = 0x1  # IFF_UP of linux/if.h


class BusSettings(BaseModel):
    """How to reach the bus; the section `bus` of a rig file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    interface: str = Field(
        default="virtual", description="python-can's name: socketcan, slcan, virtual, pcan, …"
    )
    channel: str = Field(default="coulomb", description="can0, /dev/ttyACM0, or any name on a virtual bus")
    bitrate: int = Field(
        default=1_000_000, gt=0, description="bit/s; socketcan takes it from `ip link` instead"
    )
    fd: bool = Field(default=False, description="CAN FD; the interface must support it")
    data_bitrate: int | None = Field(default=None, gt=0, description="bit/s of the data phase, CAN FD only")
    options: dict[str, str | int | float | bool] = Field(
        default_factory=dict, description="further options of the interface, passed to python-can as they are"
    )

    @model_validator(mode="after")
    def _data_bitrate_needs_fd(self) -> "BusSettings":
        if self.data_bitrate is not None and not self.fd:
            raise ValueError("data_bitrate is for CAN FD: set fd: true, or leave data_bitrate out")
        return self

    def __str__(self) -> str:
        return f"{self.interface} channel {self.channel}"


Filters = list[dict[str, Any]]
"""python-can's own form of filters"""


def pass_ids(ids: list[int]) -> Filters:
    """Filters that pass exactly these 11-bit ids."""
    return [{"can_id": can_id, "can_mask": 0x7FF, "extended": False} for can_id in ids]


def open_bus(
    settings: BusSettings, *, filters: Filters | None = None, receive_own_messages: bool = False
) -> can.BusABC:
    """Open the bus as python-can sees it; as often as it is needed.

    Adapters that can be opened only once are shared by a gateway (`drivers/gateway.py`).

    filters : python-can's `can_filters`; None receives everything

    Raises BusError, in words, when the interface or channel is not there, is down, is not permitted, or when
    an option is wrong.
    """
    if settings.interface == "virtual":
        return InProcessBus(
            channel=settings.channel, can_filters=filters, receive_own_messages=receive_own_messages
        )
    if settings.interface == "socketcan":
        check_network_interface(settings.channel)
        return _open_adapter(settings, can_filters=filters, receive_own_messages=receive_own_messages)
    return gateway.join(
        json.dumps(settings.model_dump(mode="json"), sort_keys=True),
        settings.interface,
        settings.channel,
        lambda: _open_adapter(settings),
        filters,
        receive_own_messages,
    )


def _open_adapter(settings: BusSettings, **arguments: Any) -> can.BusABC:
    """python-can's own bus; BusError in words."""
    if settings.interface not in can.VALID_INTERFACES:
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise BusError(f"interface {settings.interface!r} is not known to python-can; known are {known}")
    # whatever python-can's interface of that name takes
    options: dict[str, Any] = dict(settings.options) | arguments
    if settings.fd:
        options["fd"] = True
        if settings.data_bitrate is not None:
            options["data_bitrate"] = settings.data_bitrate
    try:
        return can.Bus(
            interface=settings.interface,
            channel=settings.channel,
            bitrate=settings.bitrate,
            ignore_config=True,
            **options,
        )
    except can.CanInterfaceNotImplementedError as error:
        raise BusError(
            f"bus {settings}: python-can cannot provide the interface {settings.interface!r} here ({error})"
        ) from error
    except (can.CanError, OSError, ValueError, TypeError) as error:
        raise BusError(f"bus {settings}: {reason_in_words(error)}") from error


def check_network_interface(channel: str) -> None:
    """Raise BusError unless `channel` is a CAN network interface of this machine that is up."""
    folder = NETWORK_CLASSES / channel
    if not folder.exists():
        present = sorted(entry.name for entry in NETWORK_CLASSES.glob("*") if _read(entry / "type") == "280")
        have = "this machine has " + ", ".join(present) if present else "this machine has no CAN interface"
        raise BusError(f"CAN interface {channel!r} is not there; {have}")
    if _read(folder / "type") != "280":  # ARPHRD_CAN of linux/if_arp.h
        raise BusError(f"network interface {channel!r} is not a CAN interface")
    if not int(_read(folder / "flags") or "0", 16) & _INTERFACE_UP:
        raise BusError(
            f"CAN interface {channel!r} is down; bring it up: "
            f"ip link set {channel} type can bitrate 1000000 && ip link set {channel} up"
        )


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii").strip()
    except OSError:
        return ""
