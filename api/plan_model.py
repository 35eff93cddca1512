"""A model of the identifier as the planner sees it: regressor, loads and torques for planned motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from api.assumed_masses import SOURCE, assumed_base_parameters, torque_limits
from daq.excitation.plan_model import Hidden, JointCoverage, PlanJudgement, PlannedMotion, PlannedParameter
from daq.rig import Rig
from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.effects.admissible import named_parameters
from identify.effects.catalogue import effects
from identify.effects.coverage import Coverage, JointLimits
from identify.effects.model import Model, Term, coupled_motors, model_name, parse_addition, parse_model
from identify.effects.motion import BlockMemory, JointMotion, JointSummary
from identify.estimation.motor_motion import GearSignals, gear_motion, pair_motion, rows_on
from identify.estimation.parameters import rotor_name
from identify.estimation.rigid_body import RigidBody
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload
from identify.results.identification import IdentificationDocument
from identify.results.reading import read_named_document

Array = NDArray[np.float64]

FRICTION_SHARE = 0.05
"""of the current limit: what dry friction, and at the highest speed viscous friction, is assumed to need"""

ASSUMED_WARMTH = (20.0, 30.0)
"""°C: what is expected of a gearbox whose temperature is recorded, that it warms up"""


@dataclass(frozen=True)
class Identified:
    """Values of parameters by name, where they come from in words, and the constants of (effect, joint) that were searched."""

    values: Mapping[str, float]
    source: str
    constants: Mapping[tuple[str, str], Mapping[str, float]] = field(default_factory=dict)

    @classmethod
    def load(cls, path: Path) -> "Identified":
        """Read what `coulomb identify --json` printed.

        Raises InputError that names the file.
        """
        return cls.of(read_named_document(IdentificationDocument, path))

    @classmethod
    def of(cls, document: IdentificationDocument) -> "Identified":
        """What an identification found."""
        values = {parameter.name: parameter.value for parameter in document.parameters}
        constants = {(each.effect, each.joint): each.values for each in document.constants}
        return cls(values, f"identified: {document.experiment}, model {document.model}", constants)


class RegressorModel:
    """Rigid robot and effects on planned motion; has the protocol `daq.excitation.plan_model.PlanModel`.

    name       : rigid, usual, load-velocity, or rigid+effect,effect…
    payloads   : those of the sessions that are planned
    additions  : EFFECT or EFFECT@JOINT
    identified : what is known; where None, masses and friction are assumed
    Raises InputError where a model, effect or joint does not exist, or an identified value is missing.
    """

    def __init__(
        self,
        rig: Rig,
        name: str,
        payloads: Sequence[Payload],
        additions: Sequence[str] = (),
        identified: Identified | None = None,
    ) -> None:
        self.name = model_name(name)
        self.is_identified = identified is not None
        self.source = identified.source if identified else SOURCE
        asked_for = {payload.name for payload in payloads}
        self._payloads = [*payloads, *(payload for payload in rig.payloads if payload.name not in asked_for)]
        self._rig = rig
        self._regressor: tuple[Array, list[Array]] | None = None
        self._body = RigidBody(
            base_parameters(Geometry.from_robot(rig.robot)),
            tuple(self._payloads),
            rig.drive_gain,
            tuple(axis.gear_ratio for axis in rig.axes),
        )
        base = self._body.base
        self._chi = (
            _identified_base(base.names, identified) if identified else assumed_base_parameters(rig, base)
        )
        self._rotors = {
            motor: identified.values.get(rotor_name(motor)[0], 0.0) if identified else 0.0
            for motor in self._body.shared_motors
        }
        model = self._parse(additions)
        summaries = [self._summary(j, len(payloads)) for j in range(len(rig.axes))]
        searched = identified.constants if identified else {}
        self._terms = [self._with_constants(term, summaries[term.joint], searched) for term in model.terms]
        named = [
            (name, joint, unit, None)
            for name, joint, unit in zip(base.names, base.joints, base.units, strict=True)
        ]
        values = self._chi.tolist()
        self._columns: list[NDArray[np.intp]] = []
        probe = self._views(self._probe(payloads))
        for term in self._terms:
            constants = dict(term.constants or ())
            width = probe.columns(term, rows_on(self._body, term)[0], constants).shape[1]
            self._columns.append(np.arange(len(named), len(named) + width))
            names = _names(term, width, summaries[term.joint])
            values += self._term_values(term, [name for name, *_ in names], identified)
            named += names
        self._values = np.array(values)
        self.parameters = tuple(
            PlannedParameter(name, joint, unit, effect, float(value) if identified else None)
            for (name, joint, unit, effect), value in zip(named, self._values, strict=True)
        )

    def rows(self, motion: PlannedMotion) -> list[tuple[NDArray[np.intp], Array]]:
        """For every joint the indices (k,) and columns (N, k) of the parameters on its rows."""
        view = self._views(motion)
        acts = self._body.base.acts
        indices = [[np.flatnonzero(acts[j])] for j in range(len(acts))]
        parts = [[view(j, j).inertial] for j in range(len(acts))]
        for term, columns in zip(self._terms, self._columns, strict=True):
            for j in rows_on(self._body, term):
                parts[j].append(view.columns(term, j, dict(term.constants or ())))
                indices[j].append(columns)
        return [
            (np.concatenate(places), np.hstack(columns))
            for places, columns in zip(indices, parts, strict=True)
        ]

    def load(self, motion: PlannedMotion) -> Array:
        """(N, n) N m: τ_out of eq. (6), the payload included."""
        view = self._views(motion)
        return np.column_stack([view(j, j).load for j in range(self._body.joints)])

    def torque(self, motion: PlannedMotion) -> Array:
        """(N, n) N m: load and friction."""
        payload = self._payload(motion)
        torque = self._body.known_load(payload, motion.q, motion.dq, motion.ddq, None)
        for j, (indices, columns) in enumerate(self.rows(motion)):
            torque[:, j] += columns @ self._values[indices]
        return torque

    def judge(self, motions: Sequence[PlannedMotion], carried: Sequence[float] = ()) -> PlanJudgement:
        """What sessions of these motions cover, and which effects of the catalogue they do not show.

        carried : kg, payloads of sessions that were measured before and are identified with these
        """
        loads = [self.load(motion) for motion in motions]
        summaries = [self._planned(j, motions, loads, carried) for j in range(len(self._rig.axes))]
        hidden: list[Hidden] = []
        for summary in summaries:
            unseen: dict[tuple[str, str], list[str]] = {}
            for effect in effects().values():
                obstacle = effect.obstacle(summary)
                if obstacle and obstacle.remedy is not None:
                    unseen.setdefault((obstacle.reason, obstacle.remedy), []).append(effect.name)
            hidden += [Hidden(summary.name, tuple(names), *why) for why, names in unseen.items()]
        masses = tuple(motion.payload.mass for motion in motions)
        return PlanJudgement(tuple(_covered(summary, masses) for summary in summaries), tuple(hidden))

    def _planned(
        self, j: int, motions: Sequence[PlannedMotion], loads: Sequence[Array], carried: Sequence[float]
    ) -> JointSummary:
        """The joint as these sessions, and those measured before, will show it."""
        limits = self._rig.axes[j].limits
        q, dq, ddq = (
            np.concatenate([getattr(m, name)[:, j] for m in motions]) for name in ("q", "dq", "ddq")
        )
        load = np.concatenate([each[:, j] for each in loads])
        speed = np.abs(dq[dq != 0.0]) if dq.any() else np.zeros(1)
        names = [payload.name for payload in self._payloads]
        of_session = [names.index(motion.payload.name) for motion in motions]
        masses = (*(payload.mass for payload in self._payloads), *carried)
        of_session += range(len(names), len(masses))
        return replace(
            self._summary(j, len(motions)),
            position_range=(float(q.min()), float(q.max())),
            position_quantiles=np.quantile(q, np.linspace(0.0, 1.0, 17)),
            maximum_speed=float(speed.max()),
            speed_quantiles=np.quantile(speed, [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99]),
            load_range=(float(load.min()), float(load.max())),
            sessions=tuple(range(len(of_session))),
            payloads=(*names, *(f"{mass:g} kg" for mass in carried)),
            payload_masses=masses,
            payload_of_session=tuple(of_session),
            session_durations=tuple(float(m.time[-1] + 0.5 * m.period) for m in motions),
            temperature_range=ASSUMED_WARMTH if self._rig.record_temperature else None,
            coverage=Coverage.of(q, dq, ddq, load, JointLimits(limits.position, limits.velocity)),
            loaded_sessions=sum(masses[payload] > 0.0 for payload in of_session),
        )

    def _parse(self, additions: Sequence[str]) -> Model:
        joints = [axis.joint for axis in self._rig.axes]
        catalogue = effects()
        gain = self._rig.drive_gain
        model = parse_model(self.name, joints, catalogue, gain)
        for addition in additions:
            model = model.with_terms(parse_addition(addition, joints, catalogue, gain))
        return model

    def _with_constants(
        self, term: Term, summary: JointSummary, searched: Mapping[tuple[str, str], Mapping[str, float]]
    ) -> Term:
        """The term with its constants as identified, else with the middle of their range: a plan that suits it suits its
        neighbours."""
        if known := searched.get((term.effect.name, summary.name)):
            return term.chosen(dict(known))
        if reason := term.effect.not_planned:
            raise InputError(f"model: '{term.effect.name}' cannot be planned for: {reason}")
        grid = term.effect.grid(summary)
        return term.chosen(grid[len(grid) // 2])

    def _payload(self, motion: PlannedMotion) -> Payload:
        names = [payload.name for payload in self._payloads]
        return self._body.payloads[names.index(motion.payload.name)]

    def _probe(self, payloads: Sequence[Payload]) -> PlannedMotion:
        """Some samples, to learn how many columns an effect has."""
        random = np.random.default_rng(0)
        q, dq, ddq = random.standard_normal((3, 8, len(self._rig.axes)))
        return PlannedMotion(payloads[0], 0.01 * np.arange(8.0), q, dq, ddq, 0.01)

    def _term_values(
        self, term: Term, names: Sequence[str], identified: Identified | None
    ) -> Sequence[float]:
        """Values of a term's parameters: as identified, else what the effect assumes; 0 where it assumes nothing."""
        if identified:
            offset = term.effect.reported_offset(dict(term.constants or ()))
            return [identified.values.get(name, offset) - offset for name in names]
        friction = FRICTION_SHARE * float(torque_limits(self._rig)[term.joint])
        speed = self._rig.axes[term.joint].limits.velocity
        return term.effect.assumed(friction, speed) or [0.0] * len(names)

    def _views(self, motion: PlannedMotion) -> "_Views":
        """The motion as effects see it; sessions that share a motion share its regressor."""
        if self._regressor is None or self._regressor[0] is not motion.q:
            self._regressor = (motion.q, self._body.inertial_columns(motion.q, motion.dq, motion.ddq))
        return _Views(self._body, self._chi, self._payload(motion), motion, self._regressor[1], self._rotors)

    def _summary(self, j: int, sessions: int) -> JointSummary:
        """The joint as sessions within its limits would show it; effects choose their constants by it."""
        axis, body = self._rig.axes[j], self._body
        limits = axis.limits
        resolution = abs(float(self._rig.position_matrix[j, j]))
        cutoff = 0.1 / self._rig.cycle
        return JointSummary(
            joint=j,
            name=axis.joint,
            revolute=self._rig.robot.joints[j].type == "revolute",
            position_range=limits.position,
            position_quantiles=np.linspace(*limits.position, 17),
            maximum_speed=limits.velocity,
            speed_quantiles=limits.velocity * np.array([0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99]),
            speed_resolution=resolution * cutoff,
            position_resolution=resolution,
            load_range=(-float(torque_limits(self._rig)[j]), float(torque_limits(self._rig)[j])),
            own_inertia=0.0,
            sessions=tuple(range(sessions)),
            payloads=tuple(payload.name for payload in self._payloads),
            payload_masses=tuple(payload.mass for payload in self._payloads),
            payload_of_session=tuple(range(sessions)),
            session_durations=(60.0,) * sessions,
            temperature_range=None,
            has_external_force=False,
            motor_ratio=abs(axis.gear_ratio),
            coupled_motors=tuple(coupled_motors(self._rig.drive_gain, j)),
            period=self._rig.cycle,
            axis_along_gravity=body.axis_along_gravity(j),
            loaded_sessions=sum(payload.mass > 0.0 for payload in self._payloads[:sessions]),
            joint_before=self._rig.axes[j - 1].joint if body.may_share_undeclared(j) else None,
        )


class _Views:
    """Planned motion as an effect of a motor or joint `owner` sees it on the rows of a joint."""

    def __init__(
        self,
        body: RigidBody,
        chi: Array,
        payload: Payload,
        motion: PlannedMotion,
        inertial: list[Array],
        rotors: Mapping[int, float],
    ) -> None:
        self._body, self._chi, self._payload, self._motion = body, chi, payload, motion
        self._inertial, self._rotors = inertial, rotors
        self._known = body.known_load(payload, motion.q, motion.dq, motion.ddq, None)
        self._load = body.load(self._inertial, chi, self._known)
        self._memory = BlockMemory()
        self._made: dict[tuple[int, int], JointMotion] = {}

    def __call__(self, joint: int, owner: int) -> JointMotion:
        if (joint, owner) not in self._made:
            self._made[joint, owner] = self._view(joint, owner)
        return self._made[joint, owner]

    def columns(self, term: Term, joint: int, constants: Mapping[str, float]) -> Array:
        """(N, parameters): the columns of a term on the rows of a joint."""
        owner = term.joint
        if term.effect.rows == "pair":
            planned = self._motion
            pair = pair_motion(
                self._body, owner, term.effect.beside, self(joint, joint), planned.dq, planned.ddq
            )
            return term.effect.columns(pair, constants)
        motion = self(owner if term.effect.rows == "gear" else joint, owner)
        if term.effect.rows != "gear" or not self._body.gears_apart[owner]:
            return term.effect.columns(motion, constants)
        planned = self._motion
        direction = np.sign(planned.dq)
        signals = GearSignals(
            planned.q, planned.dq, planned.ddq, direction, self._load, self._known, self._inertial
        )
        gear = gear_motion(self._body, motion, signals, self._rotors.get(owner, 0.0))
        return self._body.shares[joint, owner] * term.effect.columns(gear, constants)

    def _view(self, joint: int, owner: int) -> JointMotion:
        body, chi, payload, motion = self._body, self._chi, self._payload, self._motion
        motor = body.shares[:, owner]
        return JointMotion(
            joint=joint,
            time=motion.time,
            session_time=motion.time,
            experiment_time=motion.time,
            q=motion.q[:, joint],
            dq=motion.dq[:, joint],
            ddq=motion.ddq[:, joint],
            direction=np.sign(motion.dq[:, joint]),
            period=motion.period,
            load=self._load[:, joint],
            model_torque=self._load[:, joint],
            known_load=self._known[:, joint],
            payload=body.payload_index(payload),
            session=body.payload_index(payload),
            temperature=None,
            motor_velocity=motion.dq @ motor,
            motor_acceleration=motion.ddq @ motor,
            motor_share=float(body.shares[joint, owner]),
            positions=motion.q,
            inertial=self._inertial[joint],
            memory=self._memory,
            load_slope_of=lambda: body.slope_columns(joint, payload, motion.q, motion.dq, motion.ddq).at(chi),
            gravity_gradient_of=lambda: np.column_stack(
                [each.at(chi) for each in body.gravity_columns(joint, payload, motion.q)]
            ),
            payload_gradient_of=lambda: body.payload_gradient(
                joint, payload, motion.q, motion.dq, motion.ddq
            ),
            payload_columns_of=lambda: body.payload_columns(joint, motion.q, motion.dq, motion.ddq),
        )


def _covered(summary: JointSummary, masses: tuple[float, ...]) -> JointCoverage:
    """What the planner reports of a joint's coverage."""
    coverage = summary.coverage
    assert coverage is not None  # planned motion has one, with limits and loads
    assert coverage.position_share is not None
    assert coverage.top_speed_share is not None
    assert coverage.fast is not None
    assert coverage.quadrants is not None
    return JointCoverage(
        joint=summary.name,
        position_range=summary.position_range,
        position_share=coverage.position_share,
        highest_speed_share=coverage.top_speed_share,
        slow_forwards=coverage.slow_forwards,
        slow_backwards=coverage.slow_backwards,
        fast=coverage.fast,
        quadrants=coverage.quadrants,
        load_range=summary.load_range,
        payload_masses=masses,
    )


def _names(term: Term, width: int, summary: JointSummary) -> list[tuple[str, str, str, str | None]]:
    """Name, joint, unit and effect of each column, as `coulomb identify` names them."""
    listed = named_parameters(term, dict(term.constants or ()), width, summary)
    suffix = "" if term.effect.rows == "robot" else str(term.joint + 1)
    return [
        (
            parameter.name + suffix,
            summary.name,
            parameter.unit if summary.revolute else parameter.unit.replace("N m", "N").replace("rad", "m"),
            term.effect.name,
        )
        for parameter in listed
    ]


def usual_model(rig: Rig, payload: Payload, identified: Identified | None) -> RegressorModel:
    """The usual model of a rig with identified values, where these hold all its base parameters; else with assumed ones."""
    names = base_parameters(Geometry.from_robot(rig.robot)).names
    if identified is not None and not identified.values.keys() >= set(names):
        identified = None
    return RegressorModel(rig, "usual", [payload], identified=identified)


def _identified_base(names: Sequence[str], identified: Identified) -> Array:
    """(b,) base parameters; of eq. (30)'s products a_m·X and a_g·X the mean, since a_m + a_g is about 2."""
    chi: list[float] = []
    for name in names:
        products = [
            value
            for key, value in identified.values.items()
            if key.partition("@")[0] in (f"a_m·{name}", f"a_g·{name}")
        ]
        if name in identified.values:
            chi.append(identified.values[name])
        elif products:
            chi.append(float(np.mean(products)))
        else:
            raise InputError(
                f"{identified.source}: has no parameter '{name}' of this rig; it was identified on another robot"
            )
    return np.array(chi)
