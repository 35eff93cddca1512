"""What the user asked for: the record to identify from, and the model by the names of its effects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.catalogue import KnownEffects, effects
from identify.effects.dry_friction import Coulomb
from identify.effects.effect import Effect
from identify.effects.load_velocity import SMOOTH, SPLIT_BY_POWER_SIGN, GearFriction, LoadVelocity
from identify.effects.model import LINK_SIDE, Model, Term, parse_addition, parse_model
from identify.effects.transmission import CoupledFriction, MotorInertia, MotorViscous
from identify.effects.unknown_payload import UnknownPayload
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model
from identify.estimation.observation import Observation, Slot, observe
from identify.estimation.record import Record
from identify.recording import Experiment, InputError, Payload, SessionEntry

Array = NDArray[np.float64]


def open_record(experiment: Experiment, model: str = "usual") -> Record:
    """The record of an experiment that has something to identify from, for a model of that name.

    Raises InputError: there is no identification session, no joint moves, or no torque of a joint was recorded.
    """
    record = Record.of(experiment, rotors=model != LINK_SIDE)
    _require_torque(record, record.entries())
    return record


def _require_torque(record: Record, entries: Sequence[SessionEntry]) -> None:
    """Raises InputError: in all of these sessions the command of some joint is zero, or the same though the joint moves, which an
    offset of the torque alone would explain."""
    steady = np.array([record.facts(entry).steady_command for entry in entries])
    for joint in np.flatnonzero(np.all(steady == steady[0], axis=0)):
        column = f"{entries[0].path}: column 'v{joint + 1}' is"
        name = record.joint_names[joint]
        if steady[0, joint] == 0.0:
            raise InputError(f"{column} zero throughout: no torque of joint '{name}' was recorded")
        moves = record.top_speed[joint] > record.rest_speed[joint]
        if moves and not any(record.facts(entry).has_external for entry in entries):
            raise InputError(
                f"{column} {steady[0, joint]:.6g} throughout while joint '{name}' moves: a torque that never changes tells an"
                " offset and nothing else; record the command that moves the joint"
            )


def chosen_entries(record: Record, payloads: Sequence[str]) -> list[SessionEntry]:
    """The identification sessions with one of these payloads; all of them if none is named.

    Raises InputError: a payload is not declared, no identification session carries one of them, or no torque of a joint was
    recorded in those that do.
    """
    declared = [payload.name for payload in record.experiment.payloads]
    for name in payloads:
        if name not in declared:
            raise InputError(f"--payload {name}: not declared; payloads are {', '.join(declared)}")
    chosen = [entry for entry in record.entries() if not payloads or entry.payload.name in payloads]
    if not chosen:
        raise InputError(f"--payload {', '.join(payloads)}: no identification session carries it")
    _require_torque(record, chosen)
    return chosen


def with_unknown_payloads(experiment: Experiment, names: Sequence[str]) -> Experiment:
    """The experiment with nothing declared of some payloads: what they weigh is asked of the record.

    Raises InputError: a payload is not declared, no identification session carries it, or all of them do.
    """
    declared = [payload.name for payload in experiment.payloads]
    carried = {entry.payload.name for entry in experiment.sessions if entry.role == "identification"}
    for name in names:
        if name not in declared:
            raise InputError(f"--unknown-payload {name}: not declared; payloads are {', '.join(declared)}")
        if name not in carried:
            raise InputError(f"--unknown-payload {name}: no identification session carries it")
    if names and carried <= set(names):
        raise InputError(
            f"--unknown-payload {', '.join(names)}: every identification session carries what is not known; one with"
            " a known payload, or with none, is needed to tell it from the arm"
        )
    bare = {name: Payload(name=name, mass=0.0) for name in names}
    return replace(
        experiment,
        payloads=tuple(bare.get(payload.name, payload) for payload in experiment.payloads),
        sessions=tuple(
            replace(entry, payload=bare.get(entry.payload.name, entry.payload))
            for entry in experiment.sessions
        ),
    )


def with_payload_columns(record: Record, model: Model, names: Sequence[str]) -> Model:
    """The model and the ten parameters of each of these payloads.

    Raises InputError: the model has friction that depends on the load, which is not known with the payload.
    """
    if not names:
        return model
    loaded = [term.effect.name for term in model.terms if term.effect.uses_load]
    if loaded:
        raise InputError(
            f"--unknown-payload: '{loaded[0]}' needs the load, which an unknown payload is part of; ask for the payload"
            " with the model 'usual', declare what is found, and identify again"
        )
    places = [payload.name for payload in record.experiment.payloads]
    slots = {f"payload_{places.index(name)}": float(slot) for slot, name in enumerate(dict.fromkeys(names))}
    return model.with_terms([Term(UnknownPayload(), 0).chosen(slots)])


def known_effects(experiment: Experiment) -> Mapping[str, Effect]:
    """The catalogue and the user's own effects that the experiment names.

    Raises InputError: a file of an own effect is wrong, or its name is taken.
    """
    if not experiment.effects:
        return KnownEffects()
    from identify.effects.expression import load_own_effect

    known = effects().copy()
    for path in experiment.effects:
        effect = load_own_effect(path)
        beyond = [each for each in effect.neighbours if each >= len(experiment.robot.joints)]
        if beyond:
            count = len(experiment.robot.joints)
            raise InputError(
                f"{path}: columns: 'q{beyond[0] + 1}': the robot has {count} joints, q1 to q{count}"
            )
        if effect.name in known:
            raise InputError(f"{path}: name: an effect named '{effect.name}' is already in the catalogue")
        known[effect.name] = effect
    return known


def requested_model(record: Record, model: str, add: Sequence[str] = ()) -> Model:
    """The model that `--model` and `--add` name.

    Raises InputError: a name is wrong, or the record cannot show an effect that was asked for.
    """
    known, gain = known_effects(record.experiment), record.experiment.drive_gain
    wanted = parse_model(model, record.joint_names, known, gain)
    for text in add:
        terms = parse_addition(text, record.joint_names, known, gain)
        able = [t for t in terms if not t.effect.prevented(record.summaries[t.joint])]
        if not able:
            name, _, joint = text.partition("@")
            summary = record.summaries[record.joint_names.index(joint) if joint else 0]
            reason = known[name].prevented(summary) or "no joint of this robot has it"
            raise InputError(f"--add {text}: this record cannot show it: {reason}")
        wanted = wanted.with_terms(able)
    return wanted


def fit_linear(record: Record, loaded: FittedModel, add: Sequence[str]) -> FittedModel:
    """The linear form (30) on the same sessions, with the power sign of a fitted model's load."""
    known, gain = known_effects(record.experiment), record.experiment.drive_gain
    velocities = stribeck_velocities(loaded)
    terms = [
        term
        for joint in range(record.joints)
        for term in (
            Term(LoadVelocity(), joint).chosen({"stribeck_velocity": velocities[joint]}),
            *beside_gear(record, known, joint),
        )
    ]
    more = [t for text in add for t in parse_addition(text, record.joint_names, known, gain)]
    model = Model("load-velocity", tuple(terms)).with_terms(
        t
        for t in more
        if t.effect.name not in (*SPLIT_BY_POWER_SIGN, CoupledFriction.name, MotorInertia.name)
    )
    return fit_model(record, model, loaded.entries, load_from=loaded.torque, inertial=False)


def beside_gear(record: Record, known: Mapping[str, Effect], joint: int) -> list[Term]:
    """Friction of a joint beside eq. (30) for its gear: what is smooth, and, where the gear is that of a shared motor, the
    joint's own dry friction and the motor's viscous friction."""
    terms = [Term(known[name], joint) for name in SMOOTH]
    if joint in record.body.shared_motors:
        terms += [Term(known[Coulomb.name], joint), Term(MotorViscous(), joint)]
    return terms


def stribeck_velocities(loaded: FittedModel) -> list[float]:
    """q̇_s of eq. (22) for every joint: the value with the least residual, the load being a fitted model's."""
    record = loaded.record
    gear = GearFriction()
    known = known_effects(record.experiment)
    besides = [Slot.of(term) for joint in range(record.joints) for term in beside_gear(record, known, joint)]
    tried = [gear.grid(summary) for summary in record.summaries]
    for last in (False, True):
        slots = [Slot.of(Term(gear, joint), c) for joint, choices in enumerate(tried) for c in choices]
        observation = observe(record, loaded.entries, [*slots, *besides], loaded.torque)
        errors = _gear_errors(observation, [len(choices) for choices in tried], record.body.shares)
        if not last:
            best = [choices[int(np.argmin(error))] for choices, error in zip(tried, errors, strict=True)]
            listed = zip(best, record.summaries, strict=True)
            tried = [gear.refine(choice, summary) for choice, summary in listed]
    velocities = [np.array([c["stribeck_velocity"] for c in choices]) for choices in tried]
    return [
        least_between(tried_values, error) for tried_values, error in zip(velocities, errors, strict=True)
    ]


def least_between(values: Array, errors: Array) -> float:
    """Where a parabola through the least error and its neighbours, over the logarithm of the values, is least.

    values, errors : (k,), values rising; where the least error is the first or the last, that value itself
    """
    best = int(np.argmin(errors))
    if best in (0, len(values) - 1):
        return float(values[best])
    place = np.log(values[best - 1 : best + 2] / values[best])
    squares = errors[best - 1 : best + 2] ** 2
    curved, slope, _ = np.polyfit(place, squares / squares[1] - 1.0, 2)
    if curved <= 0.0:
        return float(values[best])
    return float(values[best] * np.exp(np.clip(-slope / (2 * curved), place[0], place[2])))


def _gear_errors(observation: Observation, counts: Sequence[int], shares: Array) -> list[Array]:
    """For each choice of q̇_s of each joint's gear the residual of the joint's torque.

    counts : choices of each gear; the slots are theirs, gear by gear, and behind them the smooth friction
    shares : c of `motor_shares`. Where other motors act on the joint too, they do so with the best of their own choices, so
             that joints with the fewest motors come first.
    """
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(int)
    acting = [np.flatnonzero(row) for row in shares]
    best = [int(start + count // 2) for start, count in zip(starts[:-1], counts, strict=True)]
    errors: dict[int, Array] = {}
    for joint in sorted(range(len(counts)), key=lambda each: len(acting[each])):
        on_joint = observation.joint_columns[joint]
        beside = [best[motor] for motor in acting[joint] if motor != joint]
        beside += range(starts[-1], len(observation.slots))
        rows = observation.merged(joint).r
        tau = rows[:, -1]
        residuals = []
        for choice in range(starts[joint], starts[joint + 1]):
            wanted = np.concatenate([observation.slot_columns[slot] for slot in (choice, *beside)])
            W = rows[:, np.flatnonzero(np.isin(on_joint, wanted))]
            size = np.maximum(np.linalg.norm(W, axis=0), 1e-300)
            coefficients = np.linalg.lstsq(W / size, tau, rcond=None)[0]
            residuals.append(float(np.linalg.norm(tau - (W / size) @ coefficients)))
        errors[joint] = np.array(residuals)
        best[joint] = int(starts[joint] + np.argmin(errors[joint]))
    return [errors[joint] for joint in range(len(counts))]


def ratio_columns(fitted: FittedModel) -> list[int]:
    """Columns of payload and gain ratios, whose parameter is how far the ratio is from one."""
    return [
        int(column)
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
        if slot.term.effect.estimates_ratio
        for column in columns
    ]
