"""Torques of an exported JSON document, computed from the file alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_torque
from identify.effects.expression import parse
from identify.estimation.rigid_body import POSITION_STEP
from identify.export.record_error import Motion, TorqueOf
from identify.results.exported_model import ExportedModelDocument, ExportedTorque
from identify.results.reading import read_document

Array = NDArray[np.float64]

BESIDE = (
    *("memory", "load_slope", "gravity_1", "gravity_2"),
    *("motor_velocity", "motor_acceleration", "motor_load", "motor_share"),
)
"""signals of the document's formulas beside those of a user's own effect"""


def document_torque(path: Path) -> TorqueOf:
    """What a document says, its memories carried from row to row.

    Raises InputError: the file is no such document.
    """
    document = read_document(ExportedModelDocument, path)
    joints = [link.joint for link in document.links]
    geometry = Geometry(
        np.array(document.gravity),
        np.array([link.alpha for link in document.links]),
        np.array([link.d for link in document.links]),
        np.array([link.theta for link in document.links]),
        np.array([link.r for link in document.links]),
        np.array([link.prismatic for link in document.links]),
        tuple(joints),
    )
    standard = np.array([link.standard for link in document.links]).ravel()
    arm = InverseDynamics(geometry, [standard])
    shares = np.array(document.motor_shares)
    try:
        carried = np.linalg.inv(shares)
    except np.linalg.LinAlgError:  # motors that cannot be told apart share the load alike
        carried = np.linalg.pinv(shares)

    latency = sum(max((each.derivative for each in part), default=0) for part in _in_order(document.torques))

    def across(motion: Motion) -> list[Array]:
        """(N, n) each: the load at rest under gravity along the document's directions across it."""
        still = np.zeros(motion.q.shape)
        loads = []
        for direction in document.across or ():
            tilted = replace(geometry, gravity=np.array(direction))
            (bare,) = InverseDynamics(tilted, [standard]).torques(motion.q, still, still)
            loads.append(bare + payload_torque(tilted, motion.payload, motion.q, still, still))
        return loads

    def load_slope(row: int, motion: Motion) -> Array:
        ends = []
        for step in (POSITION_STEP, -POSITION_STEP):
            moved = motion.q.copy()
            moved[:, row] += step
            (bare,) = arm.torques(moved, motion.dq, motion.ddq)
            ends.append(bare + payload_torque(geometry, motion.payload, moved, motion.dq, motion.ddq))
        return np.asarray((ends[0] - ends[1])[:, row] / (2 * POSITION_STEP), np.float64)

    def torque_of(asked: Motion) -> Array:
        return along(asked.continued(latency))[: len(asked.q)]

    @np.errstate(all="ignore")  # what is no number counts as 0
    def along(motion: Motion) -> Array:
        q, dq, ddq = motion.q, motion.dq, motion.ddq
        (bare,) = arm.torques(q, dq, ddq)
        load = np.asarray(bare + payload_torque(geometry, motion.payload, q, dq, ddq), np.float64)
        motors = np.asarray(load @ carried.T, np.float64)
        total = load.copy()
        tilts = across(motion)

        def values(torque: ExportedTorque) -> Array:
            row, motor = joints.index(torque.joint), joints.index(torque.motor)
            turns = shares[:, motor] if torque.turns is None else np.array(torque.turns)
            signals: dict[str, Array] = {
                "q": q[:, row],
                "dq": dq[:, row],
                "ddq": ddq[:, row],
                "load": load[:, row],
                "torque": whole[:, row],
                "t": motion.t,
                "temp": np.full(len(q), 20.0) if motion.temperature is None else motion.temperature[:, row],
                "direction": np.asarray(np.sign(dq[:, row]), float),
                "motor_velocity": np.asarray(dq @ turns, float),
                "motor_acceleration": np.asarray(ddq @ turns, float),
                "motor_load": motors[:, motor],
                "motor_share": np.asarray(turns[row]),
            }
            if torque.presliding_distance is not None:
                signals["memory"] = _memory(q[:, row], dq[0, row], torque.presliding_distance)
            if torque.play is not None:
                signals["memory"] = _place_in_gap(q[:, row], dq[0, row], torque.play)
            signals |= {f"gravity_{place + 1}": tilt[:, row] for place, tilt in enumerate(tilts)}
            if any("load_slope" in formula for formula in torque.formulas):
                signals["load_slope"] = load_slope(row, motion)
            columns = [parse(formula, dict.fromkeys(BESIDE))(signals) for formula in torque.formulas]
            course = sum(
                (value * column for value, column in zip(torque.values, columns, strict=True)),
                np.zeros(len(q)),
            )
            for _ in range(torque.derivative):
                course = np.gradient(course, motion.t)
            return course

        early, late = _in_order(document.torques)
        whole = total
        for torque in early:
            total[:, joints.index(torque.joint)] += values(torque)
        whole = total.copy()
        for torque in late:
            total[:, joints.index(torque.joint)] += values(torque)
        return total

    return torque_of


def _in_order(torques: Sequence[ExportedTorque]) -> tuple[list[ExportedTorque], list[ExportedTorque]]:
    """The torques that follow from motion and load, and those that are made of the sum with all of these."""
    late = [torque for torque in torques if any("torque" in each for each in torque.formulas)]
    return [torque for torque in torques if torque not in late], late


def _place_in_gap(position: Array, first_velocity: float, width: float) -> Array:
    """A link's place in a gap along a motion: at the flank behind at first, then pushed against the travel."""
    places = [-0.5 * float(np.sign(first_velocity))]
    for travel in np.diff(position).tolist():
        places.append(min(max(places[-1] - travel / width, -0.5), 0.5))
    return np.array(places)


def _memory(position: Array, first_velocity: float, distance: float) -> Array:
    """State of a presliding element along a motion: with the direction at first, then towards the direction of travel."""
    states = [float(np.sign(first_velocity))]
    for travel in np.diff(position).tolist():
        heading = float(np.sign(travel))
        states.append(
            heading + (states[-1] - heading) * float(np.exp(-abs(travel) / distance))
            if travel
            else states[-1]
        )
    return np.array(states)
