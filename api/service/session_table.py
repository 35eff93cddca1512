"""An uploaded session whose table is written in another dialect than ours, rewritten by the contract."""

import re
from pathlib import Path

from identify.recording import InputError, Robot
from identify.recording.csv_mistakes import check_header
from identify.recording.foreign import ColumnMap, ForeignTable, measure, read_foreign

_OWN_NAME = re.compile(r"^(q|v|ext|temp)\d+$")


def rewrite_by_contract(path: Path, robot: Robot) -> tuple[str, ...]:
    """Rewrite a table with the columns t, q1 ... qn, v1 ... vn in any dialect and unit; what was decided, in words.

    Nothing is done, and nothing returned, where the first line is already one of the contract.

    :raises InputError: its columns are not those of a session; says what is wrong by the contract.
    """
    n = len(robot.joints)
    try:
        check_header(path, n)
        return ()
    except InputError as mistake:
        try:
            table = read_foreign(path)
        except InputError:
            raise mistake from None
        columns = _columns(table, n)
        if columns is None:
            raise mistake from None
    samples = measure(table, columns, [not joint.revolute for joint in robot.joints])
    written = path.with_name(f"rewritten-{path.name}")
    samples.write(written)
    written.replace(path)
    return samples.remarks


def _columns(table: ForeignTable, n: int) -> ColumnMap | None:
    """The contract's columns by their names, units in them or not; None where one is missing or belongs to
    a further joint."""
    names = {column.base_name: column.name for column in reversed(table.columns)}
    position, command, external, temperature = groups = tuple(
        tuple(f"{kind}{joint}" for joint in range(1, n + 1)) for kind in ("q", "v", "ext", "temp")
    )
    contract_columns = {"t", *(each for group in groups for each in group)}
    others = {name for name in names if _OWN_NAME.match(name)} - contract_columns
    if others or not {"t", *position, *command} <= names.keys():
        return None

    def named(group: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(names[each] for each in group) if group[0] in names else ()

    extra = tuple(
        column.name
        for column in table.columns
        if column.name and column.base_name not in contract_columns and column.numbers is not None
    )
    return ColumnMap(
        named(position),
        named(command),
        named(("t",))[0],
        external=named(external),
        temperature=named(temperature),
        extra=extra,
    )
