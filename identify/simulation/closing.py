"""Which controllers close the loop of a simulation: from a file, told from the record, or as the drives held them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from identify.identification import Identification
from identify.recording import InputError
from identify.recording.controller_file import ControllerFile
from identify.results.simulation import ControllerGains, ControllerUsed
from identify.simulation.controller import (
    BY_TORQUE,
    ESTIMATED,
    OF_DRIVES,
    Controllers,
    controllers_of,
    read_controllers,
    reference_columns,
    require_restoring,
)


@dataclass(frozen=True)
class Loop:
    """A loop that is to be closed.

    columns     : of the sessions, with the reference positions
    controllers : None where they are to be told from the record
    """

    source: Literal["file", "estimated", "drives"]
    columns: tuple[str, ...]
    controllers: Controllers | None
    coordinates: Literal["joints", "motors"]
    read_from: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def used(self, controllers: Controllers) -> ControllerUsed:
        """As the document says it."""
        return ControllerUsed(
            source=self.source,
            coordinates=self.coordinates,
            read_from=self.read_from,
            joints=tuple(
                ControllerGains(**gains.model_dump(exclude={"reference"})) for gains in controllers.listed
            ),
        )


def loop_asked_for(result: Identification, controller: ControllerFile | Path | str | None) -> Loop | None:
    """The loop to close; None where the recorded torque drives the model.

    controller : gains; a YAML file of them; "estimate"; "drives"; "torque"; or None, for "drives" where the recordings hold
                 their gains

    Raises InputError: the file is wrong, other joints than the robot's are named, a gain drives its joint away from the
        reference, a session has no column of the reference, or no gains of drives are known.
    """
    experiment, names = result.experiment, result.fitted.record.joint_names
    if controller in (None, OF_DRIVES):
        loop = _recorded(result)
        if loop is None and controller == OF_DRIVES:
            raise InputError(
                "the loop cannot be closed with the gains of the drives: "
                f"{why_not_closed(result) or 'no recording holds any'}"
            )
        return loop
    if controller == BY_TORQUE:
        return None
    if controller == ESTIMATED:
        columns = tuple(f"qref{joint + 1}" for joint in range(len(names)))
        coordinates = "motors" if result.fitted.record.body.shared_motors else "joints"
        loop = Loop("estimated", columns, None, coordinates)
    else:
        given = isinstance(controller, ControllerFile)
        declared = controller if given else read_controllers(Path(controller))
        source = "the controller's gains" if given else controller
        controllers = controllers_of(declared, names, experiment.drive_gain, source)
        require_restoring(controllers, experiment.drive_gain, source)
        loop = Loop(
            "file",
            reference_columns(controllers.listed),
            controllers,
            declared.coordinates,
            declared.read_from,
            _left_out(declared),
        )
    recorded = _recorded_columns(len(names))
    for entry in experiment.sessions:
        present = experiment.read_with_setpoints(entry).extra
        for column in loop.columns:
            if column not in present:
                others = ", ".join(present) or "none"
                if column in recorded:
                    raise InputError(
                        f"the loop cannot be closed: reference: column '{column}' is {recorded[column]},"
                        f" and not the position that was commanded; further columns are {others}"
                    )
                raise InputError(
                    f"the loop cannot be closed: {entry.path}: there is no column '{column}' with the reference position; further"
                    f" columns are {others}"
                )
    return loop


def _recorded_columns(n: int) -> dict[str, str]:
    """What the columns are that every session of n joints has, or may have, beside further ones."""
    measured = {
        "q": "the measured position",
        "v": "the recorded command",
        "ext": "the external torque",
        "temp": "the temperature",
    }
    return {"t": "the time"} | {
        f"{kind}{joint}": f"{what} of joint {joint}"
        for kind, what in measured.items()
        for joint in range(1, n + 1)
    }


def _recorded(result: Identification) -> Loop | None:
    """The gains that all sessions were recorded with; None where one has none, or others."""
    experiment = result.experiment
    held = _held(result)
    first = held[0]
    if first is None or any(each is None or not each.same_gains(first) for each in held):
        return None
    names = result.fitted.record.joint_names
    controllers = controllers_of(first, names, experiment.drive_gain, experiment.sessions[0].path)
    columns = reference_columns(controllers.listed)
    return Loop("drives", columns, controllers, first.coordinates, first.read_from, _left_out(first))


def why_not_closed(result: Identification) -> str:
    """Why gains that some recordings hold do not close the loop; nothing where none does."""
    held = _held(result)
    if not any(held):
        return ""
    for entry, each in zip(result.experiment.sessions, held, strict=True):
        if each is None:
            return f"{entry.file}: the drives' gains were not read"
    return "the drives' gains were not the same in all sessions"


def _held(result: Identification) -> list[ControllerFile | None]:
    return [result.experiment.recorded_controllers(entry) for entry in result.experiment.sessions]


def _left_out(declared: ControllerFile) -> tuple[str, ...]:
    return tuple(f"not in the controllers' law: {each}" for each in declared.left_out)
