"""What is exported of an identified model: the robot's frames, a set of standard parameters, and friction as formulas."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.base_parameters import BaseParameters
from identify.dynamics.geometry import Geometry
from identify.effects.effect import LinkFilePlace, number
from identify.effects.load_velocity import LoadVelocity
from identify.estimation.context import rows_of
from identify.estimation.rigid_body import RigidBody, across
from identify.estimation.structured import GEAR, StructuredFit
from identify.identification import Identification
from identify.recording import InputError

Array = NDArray[np.float64]

RIGID = "rigid body"
"""what certificates call the inertial and gravity part of the model"""

STRUCTURED = "the structured estimate of eq. (30): one value for each parameter of arm and gear"
LINKS_ALONE = (
    "identified from torques measured on the links' side (link-side): rotor inertia and the friction of motor and gear are not"
    " in the model, so that it is no torque of the motors"
)

GRAVITY = ("gravity_1", "gravity_2")
"""signals of formulas: torque per m/s² of gravity along two directions across the declared one, on bodies at rest"""

MemoryKind = Literal["fading", "play"]


@dataclass(frozen=True)
class Memory:
    """A state that a joint's motion moves on.

    effect   : that it belongs to
    row      : the joint
    kind     : "fading", from -1 to 1, which goes towards the direction of travel over `distance`; or "play", a link's place
        in a gap of the width `distance`, from -0.5 to 0.5, which moves against the travel
    distance : rad or m
    """

    effect: str
    row: int
    kind: MemoryKind
    distance: float


@dataclass(frozen=True)
class Torque:
    """A torque of one effect on one joint.

    effect    : name in the catalogue
    row       : joint that it acts on
    motor     : joint whose motor owns it; differs from `row` where motors are coupled
    formulas  : of each column
    values    : of each column's parameter
    rubs      : whether it is friction, which damping and dry friction may stand for
    place     : attribute of a joint in link files that holds it exactly
    memory    : the state that formulas call `memory`
    derivative : how many times the sum is differentiated over time
    tilts_gravity : whether it is that of a base which is not level; values are then m/s² along `ExportedModel.directions`
    turns     : (n,) of a motor that no gain matrix declares: its velocity is turns · dq; empty where it is `motor`'s own
    """

    effect: str
    row: int
    motor: int
    formulas: tuple[str, ...]
    values: tuple[float, ...]
    rubs: bool = False
    place: LinkFilePlace | None = None
    memory: Memory | None = None
    derivative: int = 0
    tilts_gravity: bool = False
    turns: tuple[float, ...] = ()

    @property
    def formula(self) -> str:
        """The sum of the columns times their parameters."""
        return " + ".join(
            f"{number(value)} * ({formula})"
            for value, formula in zip(self.values, self.formulas, strict=True)
        )


@dataclass(frozen=True)
class ExportedModel:
    """A model without the record that it was identified from; SI units, joint space.

    chi      : (b,) base parameters
    standard : (11 n,) standard parameters that have them; a choice among many
    shares   : (n, n) of `motor_shares`: the velocity of motor m is shares[:, m] · dq
    load_shares : (n, n) of `load_shares`: the gear of motor m carries load_shares[m] · tau_out
    lost     : (effect, joint) of effects that have no formula of the state
    remarks  : what the reader must know
    """

    name: str
    experiment: str
    base: BaseParameters
    chi: Array
    standard: Array
    shares: Array
    load_shares: Array
    torques: tuple[Torque, ...]
    lost: tuple[tuple[str, int], ...]
    remarks: tuple[str, ...]

    @property
    def geometry(self) -> Geometry:
        """The robot's frames."""
        return self.base.geometry

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.geometry.joint_count

    @property
    def memories(self) -> tuple[Memory, ...]:
        """The states, each once."""
        return tuple(dict.fromkeys(torque.memory for torque in self.torques if torque.memory is not None))

    @property
    def lags(self) -> tuple[int, int]:
        """Samples that must follow one whose torque is known: for what follows from motion and load, and for what is made of
        the sum with all of that."""
        early, late = (max((each.derivative for each in part), default=0) for part in self.in_order)
        assert early <= 2  # the exported texts have no more
        assert late <= 1
        return 2 if early else 0, late

    @property
    def latency(self) -> int:
        """Cycles by which a torque stands behind the motion of its call, for differences over time to be known."""
        return sum(self.lags)

    @property
    def slopes(self) -> tuple[int, ...]:
        """Joints of which a formula needs the slope of the load over the position."""
        return tuple(dict.fromkeys(each.row for each in self.torques if "load_slope" in each.formula))

    @property
    def across(self) -> tuple[Array, Array] | None:
        """The two directions (3,) of gravity whose torque `gravity_1` and `gravity_2` are; None where no formula has them."""
        asked = any(signal in each.formula for each in self.torques for signal in GRAVITY)
        return self.directions if asked else None

    @property
    def directions(self) -> tuple[Array, Array]:
        """Two unit vectors across gravity."""
        return across(self.geometry.gravity)

    @property
    def of_the_instant(self) -> ExportedModel:
        """The model less the effects that derivatives over time are a part of, which are lost then."""
        without = {(each.effect, each.row): each.motor for each in self.torques if each.derivative}
        if not without:
            return self
        left = tuple(each for each in self.torques if (each.effect, each.row) not in without)
        return replace(self, torques=left, lost=(*self.lost, *((effect, row) for effect, row in without)))

    @property
    def may_have_no_value(self) -> bool:
        """Whether a formula is no finite number somewhere, where it counts as 0."""
        return any("finite(" in torque.formula for torque in self.torques)

    @property
    def in_order(self) -> tuple[tuple[Torque, ...], tuple[Torque, ...]]:
        """The torques that follow from motion and load, and those that are made of the sum with all of these."""
        late = tuple(torque for torque in self.torques if "torque" in torque.formula)
        return tuple(torque for torque in self.torques if torque not in late), late


def exported_model(result: Identification) -> ExportedModel:
    """What of an identification can be exported.

    Of `load-velocity` it is the structured estimate, which has one value for each physical parameter.
    """
    record, structured = result.fitted.record, result.structured
    base = record.body.base
    fitted = result.fitted if structured is None else structured.fitted
    chi = np.array(fitted.fit.chi if structured is None else structured.theta, float)[: len(base)]
    gears = {} if structured is None else _gears(structured)
    load = fitted.torque if structured is None else structured.form.load(structured.theta)
    torques: list[Torque] = []
    lost: list[tuple[str, int]] = []
    remarks = [] if structured is None else [STRUCTURED]
    if not base.rotors:
        remarks.append(LINKS_ALONE)
    remarks += result.doubts_in_words
    listed = [
        (slot, fitted.fit.chi[columns])
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
    ]
    if structured is not None:
        listed = [*load.factors, *listed]  # rotors of shared motors, which eq. (30) has in its load
    for slot, estimates in listed:
        effect, joint = slot.term.effect, slot.term.joint
        if effect.reported_offset(slot.values):
            remarks.append(
                f"{effect.name} was estimated beside the model: it corrects the loads of the record and is no part of the"
                " exported model"
            )
            continue
        if effect.of_sessions(slot.values):
            remarks.append(
                f"{effect.name} belongs to single sessions of the record, not to the machine: it is no part of the exported"
                " model, whose error on these sessions is larger for that"
            )
            continue
        formulas = effect.formulas(slot.values)
        values = tuple(float(value) for value in estimates)
        if isinstance(effect, LoadVelocity) and structured is not None:
            formulas = _gear_formulas(slot.values["stribeck_velocity"])
            values = gears[record.joint_names[joint]]
        if formulas is None:
            lost.append((effect.name, joint))
            continue
        orders = effect.formula_derivatives or (0,) * len(formulas)
        rubs = effect.dissipates or isinstance(effect, LoadVelocity)
        if effect.rows == "gear" and record.body.gears_apart[joint]:
            formulas = of_motor(formulas, load.rotor(joint))
        pair = effect.rows == "pair"
        turns = tuple(record.body.pair_turns(joint, effect.beside).tolist()) if pair else ()
        for row in rows_of(record, slot.term):
            memory = _memory(effect.name, row, slot.values)
            on_row = _under_gravity(formulas, record.body, row)
            for order in sorted(set(orders)):
                of_order = [place for place, each in enumerate(orders) if each == order]
                torques.append(
                    Torque(
                        effect.name,
                        row,
                        joint,
                        tuple(on_row[place] for place in of_order),
                        tuple(values[place] for place in of_order),
                        rubs,
                        effect.in_link_files,
                        memory,
                        order,
                        GRAVITY[0] in formulas,
                        turns,
                    )
                )
    if not np.any(chi):
        raise InputError(f"model '{result.model}': it has no rigid robot of its own that could be exported")
    return ExportedModel(
        name=result.model,
        experiment=result.experiment.name,
        base=base,
        chi=chi,
        standard=base.nearest_standard(chi),
        shares=record.body.shares,
        load_shares=record.body.load_shares,
        torques=tuple(torques),
        lost=tuple(lost),
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _under_gravity(formulas: tuple[str, ...], body: RigidBody, row: int) -> tuple[str, ...]:
    """Formulas of the torque of gravity on a joint, as `RigidBody.gravity_columns` has them: where gravity as declared makes no
    torque on it, waves of the position, or of a slide a constant."""
    if not body.axis_along_gravity(row):
        return formulas
    names = ("1.0", "1.0") if body.base.geometry.prismatic[row] else ("cos(q)", "sin(q)")
    return tuple(names[GRAVITY.index(formula)] if formula in GRAVITY else formula for formula in formulas)


def _memory(effect: str, row: int, constants: Mapping[str, float]) -> Memory | None:
    """The state that an effect with these constants has."""
    if "presliding_distance" in constants:
        return Memory(effect, row, "fading", constants["presliding_distance"])
    if "play" in constants:
        return Memory(effect, row, "play", constants["play"])
    return None


def _gears(structured: StructuredFit) -> dict[str, tuple[float, ...]]:
    """By joint the parameters of `_gear_formulas` in the structured estimate of eq. (30)."""
    by_name = {
        (name.partition("@")[0], joint): float(value)
        for (name, joint, _, _), value in zip(structured.names, structured.values, strict=True)
    }
    # the load itself is the rigid robot's torque, so that a_m and a_g count from one
    start = {"a_m": 1.0, "a_g": 1.0}
    return {
        joint: tuple(by_name[symbol, joint] - start.get(symbol, 0.0) for symbol in GEAR)
        for symbol, joint in by_name
        if symbol == GEAR[0]
    }


def _gear_formulas(stribeck_velocity: float) -> tuple[str, ...]:
    """Columns of eq. (30) of a gear whose load is known, in the order of `GEAR`."""
    fading = f"exp(-abs(dq) / {number(stribeck_velocity)})"
    driving = "0.5 * (1.0 + sign(load) * direction)"
    driven = "0.5 * (1.0 - sign(load) * direction)"
    ahead = "0.5 * (direction + sign(load))"
    back = "0.5 * (direction - sign(load))"
    return (
        f"{driving} * load",
        f"{driving} * {fading} * load",
        f"{driven} * load",
        f"-{driven} * {fading} * load",
        ahead,
        f"{fading} * {ahead}",
        back,
        f"{fading} * {back}",
    )


_OF_A_JOINT = re.compile(r"\b(dq|ddq|direction|load)\b")


def of_motor(formulas: tuple[str, ...], rotor: float) -> tuple[str, ...]:
    """Formulas of a gear's friction, in the velocity and load of its motor, on the joints that the motor turns.

    rotor : kg m², of the motor's rotor, which the gear carries beside the base parameters
    """
    carried = f"(motor_load + {number(rotor)} * motor_acceleration)" if rotor else "motor_load"
    names = {
        "dq": "motor_velocity",
        "ddq": "motor_acceleration",
        "direction": "sign(motor_velocity)",
        "load": carried,
    }
    return tuple(
        f"motor_share * ({_OF_A_JOINT.sub(lambda match: names[match[0]], formula)})" for formula in formulas
    )
