"""The columns of a joint's samples by name: what a person plots, and chooses samples by.

A fit has stored most of them. Those that only the record has (the command, external torques, further columns of its file)
are read from it when they are asked for, at the instants of the fit's samples. `position@j2` is a column of another joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from api.pages.error_figures import JointUnits
from api.pages.lru_cache import LruCache
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service.problems import Problem
from api.service.session_samples import SessionSamples
from identify.recording import Session
from identify.recording.errors import InputError

Array = NDArray[np.float64]

FURTHER = "column:"
"""Before the name of a further column of the record."""
LONGEST_NAME = 120
_recorded: LruCache[Array] = LruCache(12)


@dataclass(frozen=True)
class Column:
    """A column as a page names it; `unit` is empty where the record does not say one."""

    name: str
    label: str
    unit: str


def stored_columns(units: JointUnits) -> list[Column]:
    """What every fit has stored, of a joint with those units."""
    quantity = "force" if units.load == "N" else "torque"
    return [
        Column("time", "time in the session", "s"),
        Column("position", "position", units.position),
        Column("velocity", "speed", units.speed),
        Column("acceleration", "acceleration", units.acceleration),
        Column("load", "load", units.load),
        Column("measured", f"measured {quantity}", units.load),
        Column("predicted", f"{quantity} of the model", units.load),
        Column("error", "error", units.load),
        Column("temperature", "temperature", "°C"),
    ]


RECORDED = ("command", "external")
"""Columns of a joint that only the record has."""


@dataclass(frozen=True)
class SampleColumns:
    """Columns of the samples of one joint over some sessions, as one model has them.

    files    : sessions, in this order
    recorded : where records are read
    """

    stored: StoredExperiment
    model: ShownModel
    joint: str
    files: Sequence[str]
    recorded: SessionSamples

    def column(self, name: str) -> Column:
        """The column of that name. Raises the problem 422 for one that there is not, and 404 for an unknown joint."""
        base, _, of_joint = name.partition("@")
        if name.startswith(FURTHER):
            return Column(name, name.removeprefix(FURTHER), "")
        joint = self.stored.joint_or_first(of_joint or self.joint)
        units = self.units(joint)
        known = {each.name: each for each in stored_columns(units)} | {
            "command": Column("command", "command as recorded", ""),
            "external": Column("external", "known external torque", units.load),
        }
        if base not in known:
            raise Problem(422, f"column: `{base}` is not one of {', '.join(known)}, {FURTHER}NAME.")
        plain = known[base]
        label = plain.label if joint == self.joint else f"{plain.label} of {joint}"
        return Column(name, label, plain.unit)

    def units(self, joint: str) -> JointUnits:
        """Units of a joint's quantities."""
        place = self.stored.joint_names.index(joint)
        return JointUnits.of(self.stored.declared.robot.joints[place].type)

    def in_fit(self, name: str) -> Array:
        """(samples,) of the samples that take part in the fit; sessions follow one another.

        Raises the problems of `column`, and 409 where the record has no such column.
        """
        samples = self.stored.samples(self.model, self.joint, self.files).in_fit
        if name in {each.name for each in stored_columns(self.units(self.joint))}:
            return getattr(samples, name)
        parts = self.stored.stored_samples(self.model, self.joint, self.files)
        return np.concatenate([self.of_file(file, name)[part.moves()] for file, part in parts.items()])

    def of_file(self, file: str, name: str) -> NDArray:
        """(samples,) of all stored samples of one session, at rest too; mapped from the file where it can be."""
        column = self.column(name)
        base, _, of_joint = name.partition("@")
        time = self.stored.stored_samples(self.model, self.joint, [file])[file].time
        if base in RECORDED or column.name.startswith(FURTHER):
            key = (self.model.folder, file, self.joint, name)
            return _recorded.get(key, lambda: self._from_record(time, file, name))
        joint = self.stored.joint_or_first(of_joint or self.joint)
        part = self.stored.stored_samples(self.model, joint, [file])[file]
        values = part.measured - part.predicted if base == "error" else getattr(part, base)
        if len(values) != len(time):
            return np.interp(time, part.time, values)
        return values

    def further(self) -> list[Column]:
        """What only the record has, as its first session names it. Raises the problems of `in_fit`."""
        if not self.files:
            return []
        session = self._session(self.files[0])
        names = ["command"] + (["external"] if session.external is not None else [])
        columns = [self.column(name) for name in names]
        return columns + [Column(f"{FURTHER}{name}", name, "") for name in sorted(session.extra)]

    def _session(self, file: str) -> Session:
        try:
            return self.recorded.read(self.stored.folder, file)
        except InputError as error:
            raise Problem(422, f"The record cannot be read: {error}") from error

    def _from_record(self, time: NDArray, file: str, name: str) -> Array:
        session = self._session(file)
        base, _, of_joint = name.partition("@")
        if name.startswith(FURTHER):
            values = session.extra.get(name.removeprefix(FURTHER))
        else:
            joint = self.stored.joint_names.index(self.stored.joint_or_first(of_joint or self.joint))
            whole = getattr(session, base)
            values = None if whole is None else whole[:, joint]
        if values is None:
            raise Problem(409, f"{file} has no column {name.removeprefix(FURTHER)}.")
        return np.interp(time, session.time, np.asarray(values, dtype=float))
