"""A model's friction and cogging as the tables of the drives' own compensation, chosen for the least error on the record."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from api.compensation import require_same_robot, require_torque_of_motors
from api.drive_table_curves import curve_over_speed, curve_over_turn
from daq.drive_tables import ObjectWrite, write_tables
from daq.experiment_folder import experiment_robot
from daq.files_as_read import changed_drive, drive_digests
from daq.rig import Axis, Rig, ampere_per_unit
from drivers.compensation_objects import CompensationObjects, CurrentRow, FrictionObjects, SpeedRow
from drivers.profile import DriveProfile, load_profile, profile_names
from identify.export.exported_model import ExportedModel, Torque, exported_model
from identify.export.planned_torque import planned_torque
from identify.export.support_points import speed_line, turn_line, turn_line_at
from identify.export.write import motions_of
from identify.identification import Identification
from identify.recording import InputError
from identify.results.drive_tables import DriveTable, DriveTablesDocument, JointTables, TableObject

Array = NDArray[np.float64]
COGGING = "torque-ripple"


@dataclass(frozen=True)
class _Record:
    """(N, n) of the motors along the record: rad/s, rad from where the encoder counts zero, A of each kind."""

    speed: Array
    angle: Array
    friction: Array
    cogging: Array


def drive_tables(result: Identification, rig: Rig) -> DriveTablesDocument:
    """The tables of all drives of a rig; nothing is written.

    Raises InputError: the model is of another robot or of the links alone; no drive of the rig takes tables; a value does
        not fit its object.
    """
    require_same_robot(result, rig)
    require_torque_of_motors(result)
    _require_same_ratios(result, rig)
    # before the profiles are read, so that a change meanwhile counts as one
    digests = drive_digests(rig)
    profiles = _profiles_with_tables(rig)
    exported = exported_model(result).of_the_instant
    record = _record(exported, result, rig)
    joints = [
        _joint(rig, axis, place, profile, record, exported).changed(drive_digest=digest)
        for place, (axis, profile, digest) in enumerate(zip(rig.axes, profiles, digests, strict=True))
    ]
    return DriveTablesDocument(
        experiment=result.experiment.name,
        rig=rig.name,
        model=result.model,
        written=False,
        joints=tuple(joints),
        remarks=exported.remarks,
    )


def cleared_tables(rig: Rig) -> DriveTablesDocument:
    """Tables without any current, of all drives of a rig: their own compensation does nothing any more. Nothing is written.

    The speeds of support points stay: without currents they mean nothing, and not every drive takes a zero there.

    Raises InputError: no drive of the rig takes tables.
    """
    digests = drive_digests(rig)
    joints = [
        JointTables(
            joint=axis.joint,
            node=axis.node,
            drive=profile.name,
            drive_digest=digest,
            tables=tuple(
                _without_current(of, rows) for of, rows in _current_rows(profile.compensation).items() if rows
            ),
            remarks=() if profile.compensation is None else profile.compensation.remarks,
        )
        for axis, profile, digest in zip(rig.axes, _profiles_with_tables(rig), digests, strict=True)
    ]
    return DriveTablesDocument(
        experiment=None, rig=rig.name, model=None, written=False, joints=tuple(joints), remarks=()
    )


def tables_before(tables: DriveTablesDocument, rig: Rig) -> DriveTablesDocument:
    """What the drives held before tables were written, to be written again. Nothing is written.

    The values were read from the same objects of the same drives, in the drives' own counts: no unit, sign or number of points of
    a profile is in them. So they may go back whatever a profile says by now.

    tables : the document of that writing

    Raises InputError: it is another rig's, or nothing was written.
    """
    require_drives_of(tables, rig)
    listed = [each for joint in tables.joints for table in joint.tables for each in table.objects]
    if any(each.before is None for each in listed):
        raise InputError(
            "--back-to: the document does not say what the drives held before; --write --json prints one that does"
        )
    joints = tuple(
        joint.changed(
            drive_digest=None,
            tables=tuple(
                DriveTable(
                    of=table.of,
                    points=(),
                    constant=None,
                    wanted=None,
                    left=None,
                    # speeds first, as they were written: points that rise again before they have currents
                    objects=tuple(each.changed(value=each.before, before=None) for each in table.objects),
                )
                for table in joint.tables
            ),
        )
        for joint in tables.joints
    )
    return tables.changed(experiment=None, model=None, written=False, joints=joints)


def require_drives_of(tables: DriveTablesDocument, rig: Rig) -> None:
    """Raises InputError: tables are of another rig, joint, node or drive, whose objects mean something else there."""
    if tables.rig != rig.name:
        raise InputError(f"the tables are of rig {tables.rig}, not {rig.name}; nothing was written")
    theirs = [(joint.joint, joint.node, joint.drive) for joint in tables.joints]
    ours = [
        (axis.joint, axis.node, profile.name) for axis, profile in zip(rig.axes, rig.profiles, strict=True)
    ]
    if theirs != ours:
        there, here = (
            ", ".join(f"{joint} (node {node}, {drive})" for joint, node, drive in listed)
            for listed in (theirs, ours)
        )
        raise InputError(
            f"the tables are of the drives of {there}; rig {rig.name} has {here}: nothing was written; compute the tables of"
            " these drives"
        )


def changed_since_computed(tables: DriveTablesDocument, rig: Rig) -> str:
    """Of which drive the profile or object dictionary says something else by now, so that values of the tables may mean something
    else to it; in words as `changed_drive`. Empty where all mean what they meant, or were read from the drives themselves.

    Raises InputError as `require_drives_of`.
    """
    require_drives_of(tables, rig)
    return changed_drive(rig, [joint.drive_digest for joint in tables.joints])


def _require_same_ratios(result: Identification, rig: Rig) -> None:
    """Raises InputError: a gear has another ratio than when the model was measured.

    The drive gain, which is a product, may be the same, and then speeds and currents of the motor would both be wrong.
    """
    ratios = [joint.motor_ratio for joint in experiment_robot(rig).joints]
    for joint, ours in zip(result.experiment.robot.joints, ratios, strict=True):
        if "motor_ratio" in joint.model_fields_set and not np.isclose(joint.motor_ratio, ours, rtol=1e-6):
            raise InputError(
                f"experiment {result.experiment.name}, {joint.name}: its motor_ratio is {joint.motor_ratio:g}, in rig {rig.name}"
                f" {ours:g}; tables over the motor's speed would be those of another gear"
            )


def require_tables(rig: Rig) -> None:
    """Raises InputError: no drive of the rig takes tables."""
    _profiles_with_tables(rig)


def _profiles_with_tables(rig: Rig) -> Sequence[DriveProfile]:
    profiles = rig.profiles
    if all(profile.compensation is None for profile in profiles):
        named = ", ".join(dict.fromkeys(profile.name for profile in profiles))
        with_tables = [name for name in profile_names() if load_profile(name).compensation is not None]
        raise InputError(
            f"rig {rig.name}: no compensation tables are described for its drives ({named}): a profile's section `compensation`"
            f" says which objects hold them, as in {', '.join(with_tables)}"
        )
    return profiles


def _current_rows(takes: CompensationObjects | None) -> dict[str, list[CurrentRow]]:
    """The rows of currents of each table; none where the drive takes none."""
    if takes is None:
        return {}
    friction = takes.friction
    of_friction = [] if friction is None else [friction.forward, friction.backward, friction.constant]
    return {
        "friction": [row for row in of_friction if row is not None],
        "cogging": [] if takes.cogging is None else [takes.cogging],
    }


def _without_current(of: str, rows: Sequence[CurrentRow]) -> DriveTable:
    objects = [each for row in rows for each in _objects(row, np.zeros(row.points))]
    return DriveTable(of=of, points=(), constant=None, wanted=None, left=None, objects=tuple(objects))


def written(
    tables: DriveTablesDocument, rig: Rig, about_to_write: Callable[[DriveTablesDocument], None] | None = None
) -> DriveTablesDocument:
    """Write the tables as they were shown; the drives hold them afterwards, read back.

    about_to_write : called with the tables and what the drives hold before, once that is read and before anything is written

    Raises InputError: the tables are of other drives, or of drives whose profiles say something else by now; a drive is not
        ready to be written to; or what it holds cannot be kept, as on a full disk.
    """
    changed = changed_since_computed(tables, rig)
    if changed:
        raise InputError(
            f"rig {rig.name}, {changed} changed since the tables were computed: nothing was written; compute them again"
        )
    writes = [
        [_to_write(each) for table in joint.tables for each in table.objects] for joint in tables.joints
    ]

    def with_before(before: Sequence[Sequence[float]]) -> DriveTablesDocument:
        joints = (_with_before(joint, held) for joint, held in zip(tables.joints, before, strict=True))
        return tables.changed(joints=tuple(joints))

    def read(before: Sequence[Sequence[float]]) -> None:
        if about_to_write is None:
            return
        try:
            about_to_write(with_before(before))
        except OSError as error:
            raise InputError(
                f"what the drives hold cannot be kept ({error.strerror}): nothing was written to them"
            ) from error

    return with_before(write_tables(rig, writes, read)).changed(written=True)


def _record(model: ExportedModel, result: Identification, rig: Rig) -> _Record:
    parts: list[tuple[Array, Array, Array, Array]] = []
    for motion in motions_of(result):
        friction, cogging = (
            np.asarray(
                np.linalg.solve(
                    rig.drive_gain, planned_torque(replace(model, torques=torques), motion).beside.T
                ).T,
                np.float64,
            )
            for torques in (_rubbing(model), _cogging(model))
        )
        angle = (motion.q - rig.position_offset) @ rig.motor_gear.T
        parts.append((motion.dq @ rig.motor_gear.T, angle, friction, cogging))
    return _Record(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _rubbing(model: ExportedModel) -> tuple[Torque, ...]:
    """Friction, and the offset that a table's constant may hold. What is made of the sum with all others is left out."""
    early, _ = model.in_order
    return tuple(torque for torque in early if torque.rubs or torque.effect == "offset")


def _cogging(model: ExportedModel) -> tuple[Torque, ...]:
    return tuple(torque for torque in model.torques if torque.effect == COGGING)


def _joint(
    rig: Rig, axis: Axis, place: int, profile: DriveProfile, record: _Record, model: ExportedModel
) -> JointTables:
    takes = profile.compensation
    tables: list[DriveTable] = []
    remarks: list[str] = []
    if takes is None:
        remarks.append(f"the profile {profile.name} describes no compensation tables")
    else:
        # the drive's own sign: what it counts up as current, and the motor's direction that it counts up as position
        sign = profile.current_reference.sign
        if takes.friction is not None and np.any(record.friction[:, place]):
            tables.append(_friction(axis, takes.friction, record, place, sign))
        if takes.cogging is not None and np.any(record.cogging[:, place]):
            tables.append(_over_turn(axis, takes.cogging, record, place, sign))
        elif takes.cogging is None and any(torque.motor == place for torque in _cogging(model)):
            remarks.append("the drive takes no table of cogging: the model's torque ripple is left out")
        remarks += takes.remarks
    return JointTables(
        joint=axis.joint, node=axis.node, drive=profile.name, tables=tuple(tables), remarks=tuple(remarks)
    )


def _friction(axis: Axis, objects: FrictionObjects, record: _Record, place: int, sign: int) -> DriveTable:
    speed, current = record.speed[:, place], record.friction[:, place]
    shape = (objects.speeds.points, objects.backward is None, objects.constant is not None)
    line = speed_line(speed, current, *shape)
    if objects.speeds.largest is not None:
        largest = objects.speeds.largest * objects.speeds.radians
        if line.speeds[-1] > largest:
            # beyond what the object takes there is no point: the best line within
            slow = np.abs(speed) <= largest
            line = speed_line(speed[slow], current[slow], *shape)
    speeds = line.speeds
    listed = _objects(objects.speeds, speeds / objects.speeds.radians)
    rows = [(objects.forward, line.forward), (objects.backward, line.backward)]
    rows.append((objects.constant, np.array([line.constant])))
    for row, values in rows:
        if row is not None:
            listed += _objects(row, sign * values / ampere_per_unit(axis, row.unit))
    left = current - line.at(speed)
    return DriveTable(
        of="friction",
        points=tuple(zip(speeds.tolist(), line.forward.tolist(), line.backward.tolist(), strict=True)),
        model=curve_over_speed(speed, current),
        constant=line.constant if objects.constant is not None else None,
        wanted=_rms(current),
        left=_rms(left),
        objects=tuple(listed),
    )


def _over_turn(axis: Axis, row: CurrentRow, record: _Record, place: int, sign: int) -> DriveTable:
    angle, current = record.angle[:, place], record.cogging[:, place]
    values = turn_line(angle, current, row.points)
    return DriveTable(
        of="cogging",
        points=tuple((number / row.points, float(value)) for number, value in enumerate(values)),
        model=curve_over_turn(angle, current),
        constant=None,
        wanted=_rms(current),
        left=_rms(current - turn_line_at(values, angle)),
        objects=tuple(_objects(row, sign * values / ampere_per_unit(axis, row.unit))),
    )


def _objects(row: SpeedRow | CurrentRow, values: Array) -> list[TableObject]:
    try:
        raw = row.raw(values)
    except ValueError as problem:
        raise InputError(f"a table cannot be written: {problem}") from None
    return [
        TableObject(
            object=f"0x{row.index:04X}:{row.subindex + number:02X}", type=row.type, value=value, before=None
        )
        for number, value in enumerate(raw)
    ]


def _to_write(each: TableObject) -> ObjectWrite:
    index, _, subindex = each.object.partition(":")
    return ObjectWrite(int(index, 16), int(subindex, 16), each.type, each.value)


def _with_before(joint: JointTables, held: Sequence[float]) -> JointTables:
    values = iter(held)
    return joint.changed(
        tables=tuple(
            table.changed(objects=tuple(each.changed(before=next(values)) for each in table.objects))
            for table in joint.tables
        )
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
