"""Who has which CAN bus, and for what.

Two masters on one bus end in drives that obey both, so nobody in this service opens a bus without a claim on it. A claim is
an object whose end gives the bus back. A bus is known by its interface and channel, not by the rig: two rig files may name
the same one.
"""

from dataclasses import dataclass
from threading import Lock
from types import TracebackType
from typing import Protocol, Self

from api.service.problems import Problem
from drivers.bus import BusSettings
from drivers.bus_claim import user_of


class BusHolder(Protocol):
    """What a bus is claimed for: a payload session or a homing."""

    @property
    def moves(self) -> bool:
        """Whether it moves axes now, or may begin to without asking for anything more."""
        ...

    @property
    def refusal(self) -> str:
        """For somebody else who wants the bus: what has it, and how it becomes free."""
        ...


@dataclass(frozen=True)
class _Bus:
    """The address of a bus as this computer sees it."""

    interface: str
    channel: str

    @classmethod
    def of(cls, rig: str, settings: BusSettings) -> Self:
        # A virtual bus lives in the process that opens it: two sessions never share one.
        return cls(settings.interface, rig if settings.interface == "virtual" else settings.channel)


class BusClaim:
    """A bus that is held; `release` (or the end of a `with` block) gives it back."""

    def __init__(self, owner: "BusClaims", bus: _Bus, rig: str, holder: BusHolder) -> None:
        self._owner = owner
        self._bus = bus
        self.rig = rig
        self.holder = holder

    def release(self) -> None:
        """Give the bus back; harmless when repeated."""
        self._owner._release(self._bus, self)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


class BusClaims:
    """The owner of every bus of this service; asked before a bus is opened, and by whoever must know what moves.

    What runs in this service holds its buses here. Of another program on this computer (`coulomb run`, `coulomb home`, a
    second service) the kernel says which bus it uses; between both answers and the opening of the bus, the process that
    opens it claims it (`drivers.bus_claim`), and only one can.
    """

    def __init__(self) -> None:
        self._claims: dict[_Bus, BusClaim] = {}
        self._lock = Lock()

    def claim(self, rig: str, settings: BusSettings, holder: BusHolder) -> BusClaim:
        """Take a rig's bus for `holder`.

        rig      : id of the rig
        settings : its bus

        Raises the problem 409, with what has the bus (in this service, or another program) and how it becomes free.
        """
        bus = _Bus.of(rig, settings)
        with self._lock:
            held = self._claims.get(bus)
            if held is not None:
                other = "" if held.rig == rig else f" on the same bus ({settings})"
                raise Problem(409, f"Rig {held.rig}{other}: {held.holder.refusal}")
            if (user := user_of(settings)) is not None:
                raise Problem(
                    409,
                    f"Rig {rig}: its bus ({settings}) is in use by {user}; wait until that has ended, or end it.",
                )
            claim = BusClaim(self, bus, rig, holder)
            self._claims[bus] = claim
        return claim

    def holder(self, rig: str) -> BusHolder | None:
        """What has claimed the bus of that rig, or None."""
        return next((claim.holder for claim in self._held() if claim.rig == rig), None)

    def moves(self, rig: str) -> bool:
        """Whether something moves the rig, or may begin to without asking for anything more."""
        holder = self.holder(rig)
        return holder is not None and holder.moves

    def _held(self) -> list[BusClaim]:
        with self._lock:
            return list(self._claims.values())

    def _release(self, bus: _Bus, claim: BusClaim) -> None:
        with self._lock:
            if self._claims.get(bus) is claim:
                del self._claims[bus]
