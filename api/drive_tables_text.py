"""Tables of drives as text for the terminal."""

from collections.abc import Iterator

from identify.results.drive_tables import DriveTable, DriveTablesDocument


def drive_tables_text(document: DriveTablesDocument) -> str:
    """`drive-tables --json` as text, and whether the drives hold it."""
    end = "written and read back" if document.written else "nothing was written; --write does"
    return f"{tables_text(document)}\n\n{end}"


def tables_text(document: DriveTablesDocument) -> str:
    """The tables alone."""
    return "\n".join(_lines(document))


def _lines(document: DriveTablesDocument) -> Iterator[str]:
    if document.model is None:
        yield f"{document.rig}: what the drives' own tables are to hold"
    else:
        yield f"{document.rig}: tables of {document.model} from {document.experiment}"
    for joint in document.joints:
        yield ""
        yield f"{joint.joint} (node {joint.node}, {joint.drive})"
        for table in joint.tables:
            yield from _table(table, document.written)
        for remark in joint.remarks:
            yield f"  {remark}"
    for remark in document.remarks:
        yield ""
        yield f"Remark: {remark}"


def _table(table: DriveTable, written: bool) -> Iterator[str]:
    if not table.points:
        yield f"  {table.of}"
    else:
        yield from _line(table)
    for each in table.objects:
        before = f"  (was {each.before:g})" if written and each.before is not None else ""
        yield f"    {each.object} {each.type:8s} {each.value:g}{before}"


def _line(table: DriveTable) -> Iterator[str]:
    yield f"  {table.of}: of {_ampere(table.wanted)} root mean square on the record the table leaves {_ampere(table.left)}"
    heads = ("rad/s", "A forward", "A backward") if table.of == "friction" else ("of a turn", "A")
    yield "    " + "".join(f"{head:>12s}" for head in heads)
    for point in table.points:
        yield "    " + "".join(f"{value:12.4g}" for value in point)
    if table.constant is not None:
        yield f"    in both directions {_ampere(table.constant)}"


def _ampere(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g} A"
