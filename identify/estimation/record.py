"""The record of an experiment: its sessions, the signal settings chosen, each joint summarised."""

import os
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import coupled_motors
from identify.effects.motion import JointSummary
from identify.estimation.command_limits import limits, standing_in_parts
from identify.estimation.executor import chosen_executor
from identify.estimation.rigid_body import AlongParameters, RigidBody
from identify.estimation.session_facts import SessionFacts, steady_command
from identify.estimation.stops import FILTER_REACH, STOP_TIME, recorded_stopping_speed, stopping_speed
from identify.recording import Experiment, InputError, Session, SessionEntry
from identify.recording.quantiles import quantile, quantiles
from identify.signals import MotionBlock, SignalSettings, choose_signal_settings, motion_blocks
from identify.signals.position_noise import SAMPLES, position_rounding, position_step

Array = NDArray[np.float64]

STEPS_AT_REST_SPEED = 10
"""steps of the encoder that a joint passes at its rest speed within `STOP_TIME`, from where on the positions as
recorded tell a stop from slow motion"""

REST_SPEED = 2e-3
"""part of the top speed below which a joint may be at rest"""

POSTURES = 50
"""Every so many samples one posture is looked at for the smallest inertia of a joint."""

LARGEST_HELD = 128 << 20
"""bytes of filtered motion and regressor held between passes; what a longer record needs more is computed again"""


@dataclass(frozen=True, eq=False)
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
    turns: Array
    """(reversals, 2) joint, and deviation of the instant, s"""


class PreparedBlock:
    """A block of motion and what every model of it needs: known loads and inertial columns."""

    def __init__(self, block: MotionBlock, body: RigidBody, entry: SessionEntry, drive_gain: Array) -> None:
        self.block = block
        self._body, self._entry, self._drive_gain = body, entry, drive_gain
        self._slopes: dict[int, AlongParameters] = {}
        self._tilts: dict[int, tuple[AlongParameters, ...]] = {}

    @cached_property
    def torque(self) -> Array:
        """(N, n): joint torque g_f v of eq. (7)."""
        return self.block.command @ self._drive_gain.T

    @cached_property
    def known(self) -> Array:
        """(N, n): known part of tau_out."""
        block = self.block
        return self._body.known_load(self._entry.payload, block.q, block.dq, block.ddq, block.external)

    @cached_property
    def inertial(self) -> list[Array]:
        """For each joint (N, base parameters that act on it): columns of eq. (10)."""
        return self._body.inertial_columns(self.block.q, self.block.dq, self.block.ddq)

    @cached_property
    def inertial_rows(self) -> list[Array]:
        """The same filtered and decimated, (M, columns)."""
        return [self.block.decimate(columns) for columns in self.inertial]

    @cached_property
    def measured_rows(self) -> Array:
        """(M, 2 n) filtered and decimated: Y (torque less the known load) of every joint, then tau."""
        return self.block.decimate_tables([self.torque - self.known, self.torque])

    def load_slope(self, joint: int, chi: Array) -> Array:
        """(N,): derivative of the load of a joint over its own position, for base parameters chi."""
        if joint not in self._slopes:
            block = self.block
            self._slopes[joint] = self._body.slope_columns(
                joint, self._entry.payload, block.q, block.dq, block.ddq
            )
        return self._slopes[joint].at(chi)

    def gravity_gradient(self, joint: int, chi: Array) -> Array:
        """(N, 2): torque per m/s² of gravity along two directions across the declared one."""
        if joint not in self._tilts:
            self._tilts[joint] = self._body.gravity_columns(joint, self._entry.payload, self.block.q)
        return np.column_stack([each.at(chi) for each in self._tilts[joint]])


class _ByFile(dict[str, Samples]):
    """Samples of a session, decimated when first asked for."""

    def __init__(self, gather: Callable[[str], Samples]) -> None:
        super().__init__()
        self._gather = gather

    def __missing__(self, file: str) -> Samples:
        self[file] = self._gather(file)
        return self[file]


@dataclass(eq=False)
class Record:
    """What is measured, and the rigid robot that it was measured on."""

    experiment: Experiment
    settings: SignalSettings
    body: RigidBody
    positions_of: Callable[[Session], Array] | None = None
    """(N, n) positions of a session, where they are not those recorded"""
    _facts: dict[str, SessionFacts] = field(default_factory=dict)
    _gathered: dict[str, tuple[Samples, Array, Array]] = field(default_factory=dict)
    _held: dict[str, list[PreparedBlock]] = field(default_factory=dict)
    _held_bytes: int = 0
    _columns: dict[tuple[str, Hashable, int], list[Array]] = field(default_factory=dict)
    _inertias: dict[tuple[str, ...], list[AlongParameters]] = field(default_factory=dict)
    instruments: "Record | None" = field(default=None, repr=False)
    """the same record with positions that disturbances do not reach, once somebody asked for it"""
    _token: str = field(default_factory=lambda: os.urandom(16).hex())
    """under which a worker process holds its copy"""

    @classmethod
    def of(
        cls, experiment: Experiment, settings: SignalSettings | None = None, rotors: bool = True
    ) -> "Record":
        """Open the record of an experiment; `rotors` as in `base_parameters`."""
        return cls(
            experiment, settings or choose_signal_settings(experiment), RigidBody.of(experiment, rotors)
        )

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
        """A session's samples; held by the experiment while they are small."""
        session = self.experiment.read(entry)
        if self.positions_of is None:
            return session
        return replace(session, position=self.positions_of(session))

    def with_positions(self, positions_of: Callable[[Session], Array]) -> "Record":
        """The same record with other positions; speeds at rest and all settings stay what they are."""
        other = Record(self.experiment, self.settings, self.body, positions_of, dict(self._facts))
        vars(other).update(
            top_speed=self.top_speed,
            rest_speed=self.rest_speed,
            _rest_speed_of_motors=self._rest_speed_of_motors,
        )
        return other

    def facts(self, entry: SessionEntry) -> SessionFacts:
        """What is known of a session beside its samples."""
        if entry.file not in self._facts:
            session = self.session(entry)
            steps = position_step(session.position[:SAMPLES])
            self._facts[entry.file] = SessionFacts(
                start=float(session.time[0]),
                duration=float(session.time[-1] - session.time[0]),
                period=session.sampling_period,
                position_step=steps,
                position_rounding=position_rounding(session.position[session.segments[0]][:SAMPLES]),
                steady_command=steady_command(session.command),
                standing=tuple(
                    standing_in_parts(session, motor, np.flatnonzero(turns), steps)
                    for motor, turns in enumerate(self.experiment.drive_gain.T)
                ),
                has_external=session.external is not None,
                remarks=session.remarks,
            )
        return self._facts[entry.file]

    @cached_property
    def command_limits(self) -> Array:
        """(n, 2): of every motor the lowest and the highest value that its recorded command is cut at; −∞ and ∞ where it is not
        cut."""
        facts = [self.facts(entry) for entry in self.experiment.sessions]
        return np.array(
            [limits([part for each in facts for part in each.standing[m]]) for m in range(self.joints)]
        )

    def at_limit(self, entry: SessionEntry) -> NDArray[np.bool_]:
        """(N, n): samples of a session, as recorded, in which the command of a motor stands at a limit."""
        lowest, highest = self.command_limits.T
        command = self.session(entry).command
        return (command <= lowest) | (command >= highest)

    def blocks(self, entry: SessionEntry) -> Iterator[PreparedBlock]:
        """The session's blocks of motion; held for the next pass while all that is held is small.

        Raises InputError: nothing of the session is left after trimming.
        """
        if entry.file in self._held:
            yield from self._held[entry.file]
            return
        self.facts(entry)
        session = self.session(entry)
        rows = len(session.time) // self.settings.stride(session.sampling_period)
        # motion, inertial columns, their slopes, and two directions of tilt
        cost = 8 * rows * (8 * self.joints + 4 * int(self.body.base.acts.sum()))
        hold = self._held_bytes + cost <= LARGEST_HELD
        held: list[PreparedBlock] = []
        empty = True
        for block in motion_blocks(session, self.settings, shared=self._shared):
            empty = False
            prepared = PreparedBlock(block, self.body, entry, self.experiment.drive_gain)
            if hold:
                held.append(prepared)
            yield prepared
        if empty:
            edge = self.settings.edge()
            raise InputError(
                f"{entry.path}: too short: the filters need more than {2 * edge:.3g} s of uninterrupted samples"
            )
        if hold:
            self._held[entry.file] = held
            self._held_bytes += cost

    def held_columns(self, file: str, name: Hashable, joint: int) -> list[Array] | None:
        """What `hold_columns` was given; None where nothing is held."""
        return self._columns.get((file, name, joint))

    def hold_columns(self, file: str, name: Hashable, joint: int, blocks: list[Array]) -> None:
        """Hold decimated columns on a joint's rows of a session, block by block, while all that is held is small."""
        cost = sum(block.nbytes for block in blocks)
        if file in self._held and self._held_bytes + cost <= LARGEST_HELD:
            self._columns[file, name, joint] = blocks
            self._held_bytes += cost

    def started(self, entry: SessionEntry) -> float:
        """s of recorded motion before this session, all sessions in the order of the experiment."""
        before = 0.0
        for other in self.experiment.sessions:
            if other.file == entry.file:
                return before
            before += self.facts(other).duration
        return before

    def own_inertias(self, entries: Sequence[SessionEntry], chi: Array) -> list[float]:
        """Of each joint the smallest torque per acceleration over the postures of some sessions, for base parameters chi."""
        files = tuple(entry.file for entry in entries)
        if files not in self._inertias:
            postures = np.vstack([self.samples[file].q[::POSTURES] for file in files])
            self._inertias[files] = [self.body.inertia_columns(j, postures) for j in range(self.joints)]
        return [float(np.min(each.at(chi))) for each in self._inertias[files]]

    @cached_property
    def position_resolution(self) -> Array:
        """(n,): smallest step between recorded positions, rad or m."""
        smallest = np.min([self.facts(entry).position_step for entry in self.experiment.sessions], axis=0)
        return np.where(np.isfinite(smallest), smallest, 0.0)

    @cached_property
    def speed_resolution(self) -> Array:
        """(n,): root mean square of the encoder's rounding in the filtered velocity, rad/s or m/s.

        Rounding is white with a deviation of step/√12 over the whole band; the derivative of the part below
        the cut-off f_c has the deviation step/√12 · 2π f_c √(2 f_c T / 3).
        """
        period = min(self.facts(entry).period for entry in self.experiment.sessions)
        cutoff = np.asarray(self.settings.position_cutoff, float)
        return self.position_resolution / np.sqrt(12) * 2 * np.pi * cutoff * np.sqrt(2 * cutoff * period / 3)

    @cached_property
    def samples(self) -> dict[str, Samples]:
        """Decimated samples of every session, by file; a session is passed over when it is first asked for."""
        entries = {entry.file: entry for entry in self.experiment.sessions}

        def gather(file: str) -> Samples:
            samples, filtered, recorded = self._gather(entries[file])
            rest = np.append(self.rest_speed, self._rest_speed_of_motors)
            moves = ((recorded > rest) | ~self.shows_stops) & (filtered > rest)
            moving = moves[:, : self.joints]
            for motor, moves_too in zip(self.body.shared_motors, moves[:, self.joints :].T, strict=True):
                # while a motor stops, what holds it is in the torque of every joint that it turns with
                turned = self.body.shares[:, motor] != 0
                moving = np.where(turned, moving & moves_too[:, None], moving)
            if np.isfinite(self.command_limits).any():
                moving = moving & ~self._cut(entries[file], samples.time)
            return replace(samples, moving=moving)

        return _ByFile(gather)

    def _cut(self, entry: SessionEntry, time: Array) -> NDArray[np.bool_]:
        """(M, n): decimated samples of a joint into which the parallel filter mixes a command that stands at a limit."""
        recorded, at_limit = self.session(entry).time, self.at_limit(entry)
        reach = FILTER_REACH / self.settings.decimation_cutoff
        near = np.zeros((len(time), self.joints), bool)
        for motor, turned in enumerate((self.experiment.drive_gain != 0).T):
            instants = recorded[at_limit[:, motor]]
            first, last = (np.searchsorted(instants, edge) for edge in (time - reach, time + reach))
            near[:, turned] |= (last > first)[:, None]
        return near

    def _gather_all(self, entries: Sequence[SessionEntry]) -> None:
        """Gather the sessions that are not gathered yet, where the executor says."""
        open_ = [entry for entry in entries if entry.file not in self._gathered]
        for entry, gathered in zip(
            open_, chosen_executor()(partial(Record._gather, self), open_), strict=True
        ):
            self._gathered[entry.file] = gathered

    def _gather(self, entry: SessionEntry) -> tuple[Samples, Array, Array]:
        """Samples of a session, and the stopping speeds around each, filtered and recorded, (samples, n + k)."""
        if entry.file not in self._gathered:
            parts: list[tuple[Array, ...]] = []
            for prepared in self.blocks(entry):
                block = prepared.block
                kinematics = [
                    block.at_decimated(values) for values in (block.time, block.q, block.dq, block.ddq)
                ]
                warmth = block.temperature
                temperature = np.zeros((block.count, 0)) if warmth is None else block.at_decimated(warmth)
                speeds = (stopping_speed(block), recorded_stopping_speed(block))
                picked = (*kinematics, block.decimate(prepared.torque), *speeds, temperature, block.turns)
                # copies: a picked sample would keep its whole block in memory
                parts.append(tuple(values.copy() for values in picked))
            time, q, dq, ddq, measured, filtered, recorded, temperature, turns = (
                np.concatenate(list(part)) for part in zip(*parts, strict=True)
            )
            warmth = temperature if temperature.shape[1] else None
            moving = np.ones(q.shape, bool)
            samples = Samples(entry, time, q, dq, ddq, measured, moving, warmth, turns)
            self._gathered[entry.file] = (samples, filtered, recorded)
        return self._gathered[entry.file]

    @cached_property
    def top_speed(self) -> Array:
        """(n,): 99.9 % quantile of |dq|, rad/s."""
        self._gather_all(self.experiment.sessions)
        speeds = [np.abs(self._gathered[entry.file][0].dq) for entry in self.experiment.sessions]
        return np.max([quantile(speed, 0.999) for speed in speeds], axis=0)

    @cached_property
    def rest_speed(self) -> Array:
        """(n,): speed below which a joint may be at rest, rad/s."""
        return np.maximum(REST_SPEED * self.top_speed, 3.0 * self.speed_resolution)

    @cached_property
    def _shared(self) -> Array | None:
        """(n, k): how the motors that several joints share turn with these; None where there are none."""
        motors = list(self.body.shared_motors)
        return self.body.shares[:, motors] if motors else None

    @cached_property
    def _rest_speed_of_motors(self) -> Array:
        """(k,): of the motors that several joints share, rad/s."""
        if self._shared is None:
            return np.zeros(0)
        self._gather_all(self.experiment.sessions)
        speeds = [np.abs(self._gathered[e.file][0].dq @ self._shared) for e in self.experiment.sessions]
        top = np.max([quantile(speed, 0.999) for speed in speeds], axis=0)
        resolution = np.sqrt(self.speed_resolution**2 @ self._shared**2)
        return np.maximum(REST_SPEED * top, 3.0 * resolution)

    @cached_property
    def shows_stops(self) -> NDArray[np.bool_]:
        """(n + k,): whether the positions as recorded are fine enough to tell a stop from slow motion; of the joints, then
        of the motors that several of them share."""
        rounding = np.max([self.facts(entry).position_rounding for entry in self.experiment.sessions], axis=0)
        if self._shared is not None:
            rounding = np.append(rounding, np.sqrt(rounding**2 @ self._shared**2))
        rest = np.append(self.rest_speed, self._rest_speed_of_motors)
        return STEPS_AT_REST_SPEED * rounding <= rest * STOP_TIME

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
        warmth = np.concatenate(temperatures) if len(temperatures) == len(samples) else np.zeros(0)
        periods = [self.facts(entry).period for entry in entries]
        description = experiment.robot.joints[joint]
        return JointSummary(
            joint=joint,
            name=description.name,
            revolute=description.type == "revolute",
            position_range=(float(q.min()), float(q.max())),
            position_quantiles=quantiles(q, np.linspace(0, 1, 17)),
            maximum_speed=float(self.top_speed[joint]),
            speed_quantiles=quantiles(moving, [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])
            if len(moving)
            else np.zeros(9),
            speed_resolution=float(self.speed_resolution[joint]),
            position_resolution=float(self.position_resolution[joint]),
            load_range=(0.0, 0.0),
            own_inertia=0.0,
            payloads=tuple(payload.name for payload in experiment.payloads),
            payload_masses=tuple(payload.mass for payload in experiment.payloads),
            sessions=tuple(
                index for index, entry in enumerate(experiment.sessions) if entry.role == "identification"
            ),
            payload_of_session=tuple(self.body.payload_index(entry.payload) for entry in entries),
            session_durations=tuple(self.facts(entry).duration for entry in entries),
            temperature_range=(float(warmth.min()), float(warmth.max()))
            if warmth.size and np.isfinite(warmth).all()
            else None,
            has_external_force=any(self.facts(entry).has_external for entry in entries),
            motor_ratio=float(description.motor_ratio or 1.0),
            coupled_motors=tuple(coupled_motors(experiment.drive_gain, joint)),
            period=min(periods),
            axis_along_gravity=self.body.axis_along_gravity(joint),
            loaded_sessions=sum(entry.payload.mass > 0 for entry in entries),
            joint_before=experiment.robot.joints[joint - 1].name
            if self.body.may_share_undeclared(joint)
            else None,
        )

    def __reduce__(self) -> tuple[Callable[..., "Record"], tuple[object, ...]]:
        """For another process: the figures found so far go along, samples are read and filtered there."""
        figures = (
            "_facts",
            "position_resolution",
            "top_speed",
            "rest_speed",
            "_rest_speed_of_motors",
            "shows_stops",
        )
        known = {name: vars(self)[name] for name in figures if name in vars(self)}
        return _arrived, (self.experiment, self.settings, self.body, self.positions_of, self._token, known)


_copy_here: dict[str, Record] = {}
"""The copy that this worker process has of the record that it was sent last, by its token."""


def _arrived(
    experiment: Experiment,
    settings: SignalSettings,
    body: RigidBody,
    positions_of: Callable[[Session], Array] | None,
    token: str,
    known: dict[str, object],
) -> Record:
    """The record in a process that it was sent to: the copy that is there from an earlier pass, with the motion
    that it holds, or a new one in the place of another record's.
    """
    record = _copy_here.get(token)
    if record is None:
        record = Record(experiment, settings, body, positions_of, _token=token)
        _copy_here.clear()
        _copy_here[token] = record
    vars(record).update(known)
    return record
