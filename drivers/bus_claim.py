"""One user of a bus at a time, whichever process and whichever user of this computer it is.

Whoever commands drives or asks them holds the claim: a session, homing, a fault reset, a scan. It is a listening socket in
Linux's abstract namespace, named after the bus. The kernel gives the name to one process only, takes it back when that
process ends, however it ends, and tells anybody who asks who has it; no file stays behind, and no permission is in the
way between users. Like a CAN interface, the name belongs to a network namespace.
"""

import contextlib
import os
import socket
import struct
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Self

from drivers.bus import BusSettings
from drivers.errors import BusError

_CREDENTIALS = struct.Struct("3i")  # struct ucred: pid, uid, gid

_here: dict[str, str] = {}
"""names that this process has claimed, and for what"""
_lock = threading.Lock()


class BusInUse(BusError):
    """Somebody else has the bus."""


class BusClaim:
    """The right to use a bus; a context manager. A virtual bus ends with its process and needs none.

    purpose : what for, in words that the next one reads

    Raises BusInUse, naming process and user, while somebody else has it.
    """

    def __init__(self, settings: BusSettings, purpose: str) -> None:
        self._name = _name(settings)
        self._socket: socket.socket | None = None
        if settings.interface == "virtual" or sys.platform != "linux":
            return
        with _lock:
            if self._name in _here:
                raise BusInUse(_words(settings, f"this process ({_here[self._name]})"))
            held = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                held.bind(_address(self._name))
            except OSError:
                held.close()
                raise BusInUse(_words(settings, _holder(self._name) or "another process")) from None
            held.listen(1)
            _here[self._name] = purpose
            self._socket = held

    def close(self) -> None:
        """Give the bus back; harmless when repeated."""
        with _lock:
            if self._socket is not None:
                self._socket.close()
                self._socket = None
                _here.pop(self._name, None)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def user_of(settings: BusSettings) -> str | None:
    """Who on this computer uses a bus now, in words for an operator; None where nobody does, or it is virtual."""
    name = _name(settings)
    if settings.interface == "virtual" or sys.platform != "linux":
        return None
    with _lock:
        if name in _here:
            return f"this process ({_here[name]})"
        return _holder(name)


def _name(settings: BusSettings) -> str:
    channel = settings.channel
    if channel.startswith("/"):
        channel = os.path.realpath(channel)  # /dev/serial/by-id/… and /dev/ttyACM0 are one adapter
    return f"coulomb-bus:{settings.interface}:{channel}"


def _address(name: str) -> bytes:
    return b"\0" + name.encode()[:100]


def _words(settings: BusSettings, holder: str) -> str:
    return (
        f"bus {settings} is in use by {holder}; nothing was sent to it. Wait until that has ended, or end it; two masters on "
        "one bus would move each other's drives"
    )


def _holder(name: str) -> str | None:
    """Who listens under that name, in words, as the kernel says; None where it names nobody."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.setblocking(False)
        asking.connect(_address(name))
        process, user, _ = _CREDENTIALS.unpack(
            asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        )
        return f"process {process}{_command(process)}, {_user(user)}"
    return None


def _command(process: int) -> str:
    try:
        arguments = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
    except OSError:
        return ""
    text = " ".join(word.decode(errors="replace") for word in arguments if word)
    if "daq.acquisition" in text:
        text = "a session's acquisition process"
    return f" ({text[:80]})" if text else ""


def _user(number: int) -> str:
    import pwd

    try:
        return f"user {pwd.getpwuid(number).pw_name}"
    except KeyError:
        return f"user {number}"
