"""The simulated drive's own compensation of friction and cogging: tables that it adds to what its loops ask for."""

from bisect import bisect_right

from pydantic import BaseModel, ConfigDict, Field, model_validator

SPEED_POINTS = 8
COGGING_POINTS = 32
SPEEDS, FORWARD, BACKWARD, CONSTANT, COGGING = 0x2020, 0x2021, 0x2022, 0x2023, 0x2024
"""objects of simulated.eds: 0.01 rpm at the first, mA at all others"""


class CompensationSettings(BaseModel):
    """What stands in a drive's tables when it is switched on."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    speeds: tuple[float, ...] = Field(
        default=(), max_length=SPEED_POINTS, description="rpm of the motor, rising"
    )
    forward: tuple[float, ...] = Field(default=(), description="A at these speeds")
    backward: tuple[float, ...] = Field(
        default=(), description="A at the same speeds backward, with their sign"
    )
    constant: float = Field(default=0.0, description="A, in both directions and at rest")
    cogging: tuple[float, ...] = Field(
        default=(),
        max_length=COGGING_POINTS,
        description="A over a turn of the motor from where the encoder counts zero",
    )

    @model_validator(mode="after")
    def _lengths(self) -> "CompensationSettings":
        if not len(self.speeds) == len(self.forward) == len(self.backward):
            raise ValueError("speeds, forward and backward must be of one length")
        return self


class Compensation:
    """The tables in the raw counts of their objects, and the current that they give."""

    def __init__(self, settings: CompensationSettings, counts_per_turn: int) -> None:
        self._counts_per_turn = counts_per_turn
        self.raw: dict[int, list[int]] = {
            SPEEDS: _filled([100.0 * speed for speed in settings.speeds], SPEED_POINTS),
            FORWARD: _filled([1e3 * current for current in settings.forward], SPEED_POINTS),
            BACKWARD: _filled([1e3 * current for current in settings.backward], SPEED_POINTS),
            CONSTANT: [round(1e3 * settings.constant)],
            COGGING: _filled([1e3 * current for current in settings.cogging], COGGING_POINTS),
        }
        self._active = False
        self.take()

    def take(self) -> None:
        """The raw tables have changed. Points whose speed does not rise are left out."""
        speeds, forward, backward = [0.0], [0.0], [0.0]
        for speed, ahead, back in zip(self.raw[SPEEDS], self.raw[FORWARD], self.raw[BACKWARD], strict=True):
            in_counts = speed * 0.01 / 60.0 * self._counts_per_turn
            if in_counts > speeds[-1]:
                speeds.append(in_counts)
                forward.append(1e-3 * ahead)
                backward.append(1e-3 * back)
        self._speeds, self._forward, self._backward = speeds, forward, backward
        self._cogging = [1e-3 * current for current in self.raw[COGGING]]
        self._constant = 1e-3 * self.raw[CONSTANT][0]
        self._active = any(any(self.raw[table]) for table in (FORWARD, BACKWARD, CONSTANT, COGGING))

    def current(self, velocity: float, position: int) -> float:
        """A to add.

        velocity : counts/s, as commanded
        position : counts
        """
        if not self._active:
            return 0.0
        line = self._forward if velocity >= 0.0 else self._backward
        return self._constant + self._over_speed(line, abs(velocity)) + self._over_turn(position)

    def _over_speed(self, line: list[float], speed: float) -> float:
        after = bisect_right(self._speeds, speed)
        if after == len(self._speeds):
            return line[-1]
        share = (speed - self._speeds[after - 1]) / (self._speeds[after] - self._speeds[after - 1])
        return line[after - 1] + share * (line[after] - line[after - 1])

    def _over_turn(self, position: int) -> float:
        place = position % self._counts_per_turn / self._counts_per_turn * COGGING_POINTS
        first = int(place)
        here, there = self._cogging[first], self._cogging[(first + 1) % COGGING_POINTS]
        return here + (place - first) * (there - here)


def _filled(values: list[float], length: int) -> list[int]:
    return [round(value) for value in values] + [0] * (length - len(values))
