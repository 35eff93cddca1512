"""The record of an experiment: its sessions read, the signal settings chosen, each joint summarised."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import coupled_motors
from identify.effects.motion import JointSummary
from identify.estimation.rigid_body import RigidBody
from identify.recording import Experiment, InputError, Session, SessionEntry
from identify.signals import MotionBlock, SignalSettings, choose_signal_settings, motion_blocks

Array = NDArray[np.float64]

REST_TIME = 0.1
"""s. A joint that stays below its rest speed for this long is at rest: the friction there is whatever holds it,
and sign(dq) is noise. Shorter pauses are reversals and belong to the motion."""

REST_SPEED = 2e-3
"""part of the top speed below which a joint may be at rest"""

RESOLUTION_SAMPLES = 50_000
"""positions looked at to find the encoder's step; the step shows within the first moves"""


@dataclass(frozen=True)
class Samples:
    """Decimated samples of one session; (samples, joints) unless said otherwise."""

    entry: SessionEntry
    time: Array
    """(samples,) s"""
    q: Array
    dq: Array
    ddq: Array
    measured: Array
    """filtered torque g_f v, N m"""
    moving: NDArray[np.bool_]
    temperature: Array | None


@dataclass
class Record:
    """What is measured, and the rigid robot that it was measured on."""

    experiment: Experiment
    settings: SignalSettings
    body: RigidBody
    _sessions: dict[str, Session] = field(default_factory=dict)

    @classmethod
    def of(cls, experiment: Experiment, settings: SignalSettings | None = None) -> "Record":
        """Open the record of an experiment."""
        return cls(experiment, settings or choose_signal_settings(experiment), RigidBody.of(experiment))

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.experiment.n

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints."""
        return [joint.name for joint in self.experiment.robot.joints]

    def entries(self, role: str = "identification") -> list[SessionEntry]:
        """The sessions of a role."""
        return [entry for entry in self.experiment.sessions if entry.role == role]

    def session(self, entry: SessionEntry) -> Session:
        """A session, read once."""
        if entry.file not in self._sessions:
            self._sessions[entry.file] = self.experiment.read(entry)
        return self._sessions[entry.file]

    def blocks(self, entry: SessionEntry) -> Iterator[MotionBlock]:
        """The session's blocks of motion.

        :raises InputError: nothing of the session is left after trimming.
        """
        empty = True
        for block in motion_blocks(self.session(entry), self.settings):
            empty = False
            yield block
        if empty:
            edge = self.settings.edge()
            raise InputError(
                f"{entry.path}: too short: the filters need more than {2 * edge:.3g} s of uninterrupted samples"
            )

    def torque(self, block: MotionBlock) -> Array:
        """(N, n): joint torque g_f v of eq. (7)."""
        return block.command @ self.experiment.drive_gain.T

    def started(self, entry: SessionEntry) -> float:
        """s of recorded motion before this session, all sessions in the order of the experiment."""
        before = 0.0
        for other in self.experiment.sessions:
            if other.file == entry.file:
                return before
            time = self.session(other).time
            before += float(time[-1] - time[0])
        return before

    @cached_property
    def position_resolution(self) -> Array:
        """(n,): smallest step between recorded positions, rad or m."""
        smallest = np.full(self.joints, np.inf)
        for entry in self.experiment.sessions:
            position = self.session(entry).position[:RESOLUTION_SAMPLES]
            for joint in range(self.joints):
                steps = np.abs(np.diff(position[:, joint]))
                steps = steps[steps > 1e-12 * max(1.0, float(np.abs(position[:, joint]).max()))]
                if len(steps):
                    smallest[joint] = min(smallest[joint], float(steps.min()))
        return np.where(np.isfinite(smallest), smallest, 0.0)

    @cached_property
    def speed_resolution(self) -> Array:
        """(n,): root mean square of the encoder's rounding in the filtered velocity, rad/s or m/s.

        Rounding is white with a deviation of step/√12 over the whole band; the derivative of the part below
        the cut-off f_c has the deviation step/√12 · 2π f_c √(2 f_c T / 3).
        """
        period = min(self.session(entry).sampling_period for entry in self.experiment.sessions)
        cutoff = np.asarray(self.settings.position_cutoff, float)
        return self.position_resolution / np.sqrt(12) * 2 * np.pi * cutoff * np.sqrt(2 * cutoff * period / 3)

    @cached_property
    def samples(self) -> dict[str, Samples]:
        """Decimated samples of every session, by file."""
        return {entry.file: self._gather(entry) for entry in self.experiment.sessions}

    def _gather(self, entry: SessionEntry) -> Samples:
        parts: list[tuple[Array, ...]] = []
        for block in self.blocks(entry):
            kinematics = [block.at_decimated(values) for values in (block.time, block.q, block.dq, block.ddq)]
            warmth = block.temperature
            temperature = np.zeros((block.count, 0)) if warmth is None else block.at_decimated(warmth)
            fast = np.stack([block.at_decimated(slow) for slow in self._slow(block)], axis=1)
            parts.append((*kinematics, block.decimate(self.torque(block)), fast, temperature))
        time, q, dq, ddq, measured, slow, temperature = (
            np.concatenate(list(part)) for part in zip(*parts, strict=True)
        )
        return Samples(
            entry,
            time,
            q,
            dq,
            ddq,
            measured,
            ~slow.astype(bool),
            temperature if temperature.shape[1] else None,
        )

    def _slow(self, block: MotionBlock) -> list[NDArray[np.bool_]]:
        """For each joint whether it has been below its rest speed all around an instant."""
        return [
            resting(block.dq[:, joint], self.rest_speed[joint], block.sampling_period)
            for joint in range(self.joints)
        ]

    @cached_property
    def top_speed(self) -> Array:
        """(n,): 99.9 % quantile of |dq|, rad/s."""
        fastest = np.zeros(self.joints)
        for entry in self.experiment.sessions:
            speeds = [np.abs(block.at_decimated(block.dq)) for block in self.blocks(entry)]
            fastest = np.maximum(fastest, np.quantile(np.concatenate(speeds), 0.999, axis=0))
        return fastest

    @cached_property
    def rest_speed(self) -> Array:
        """(n,): speed below which a joint may be at rest, rad/s."""
        return np.maximum(REST_SPEED * self.top_speed, 3.0 * self.speed_resolution)

    @cached_property
    def summaries(self) -> list[JointSummary]:
        """Each joint over the whole record."""
        return [self._summary(joint) for joint in range(self.joints)]

    def _summary(self, joint: int) -> JointSummary:
        experiment = self.experiment
        entries = self.entries()
        samples = [self.samples[entry.file] for entry in entries]
        moving = np.concatenate([np.abs(part.dq[part.moving[:, joint], joint]) for part in samples])
        q = np.concatenate([part.q[:, joint] for part in samples])
        temperatures = [part.temperature[:, joint] for part in samples if part.temperature is not None]
        warmed = len(temperatures) == len(samples) and np.ptp(np.concatenate(temperatures)) > 1.0
        periods = [self.session(entry).sampling_period for entry in entries]
        description = experiment.robot.joints[joint]
        return JointSummary(
            joint=joint,
            name=description.name,
            revolute=description.type == "revolute",
            position_range=(float(q.min()), float(q.max())),
            maximum_speed=float(self.top_speed[joint]),
            speed_quantiles=np.quantile(moving, [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])
            if len(moving)
            else np.zeros(9),
            speed_resolution=float(self.speed_resolution[joint]),
            position_resolution=float(self.position_resolution[joint]),
            load_range=(0.0, 0.0),
            payloads=tuple(payload.name for payload in experiment.payloads),
            payload_masses=tuple(payload.mass for payload in experiment.payloads),
            payload_of_session=tuple(self.body.payload_index(entry.payload) for entry in entries),
            session_durations=tuple(float(np.ptp(self.session(entry).time)) for entry in entries),
            has_temperature=bool(warmed),
            has_external_force=any(self.session(entry).external is not None for entry in entries),
            motor_ratio=float(description.motor_ratio or 1.0),
            coupled_motors=tuple(coupled_motors(experiment.drive_gain, joint)),
            period=min(periods),
            decimated_period=min(self.settings.decimation_factor(period) * period for period in periods),
            axis_along_gravity=self.body.axis_along_gravity(joint),
            loaded_sessions=sum(entry.payload.mass > 0 for entry in entries),
        )

    def summarise_load(self, joint: int, load: Array, lines: tuple[float, ...] = ()) -> JointSummary:
        """The summary of a joint with the range of its fitted load."""
        return replace(
            self.summaries[joint], load_range=(float(load.min()), float(load.max())), position_lines=lines
        )


def resting(velocity: Array, speed: float, period: float) -> NDArray[np.bool_]:
    """Samples whose whole neighbourhood, half of `REST_TIME` to either side, is slower than `speed`."""
    half = max(1, round(0.5 * REST_TIME / period))
    fast = np.concatenate([[0], np.cumsum(np.abs(velocity) > speed)])
    index = np.arange(len(velocity))
    return fast[np.minimum(index + half + 1, len(velocity))] == fast[np.maximum(index - half, 0)]
