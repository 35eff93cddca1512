"""The result of an identification as tables for the terminal."""

from collections.abc import Iterable, Sequence

from rich import box
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from identify.results.comparison import ModelErrors
from identify.results.effect import CatalogueEffect
from identify.results.identification import (
    FeasibleParameters,
    IdentificationDocument,
    Parameter,
    PriorComparison,
    StructuredEstimate,
)

NARROWEST = 100
"""columns; where the output is not a terminal tables are set at least this wide, so that nothing is cut"""


def print_identification(document: IdentificationDocument) -> None:
    """Print the document of `identify --json` for a reader."""
    console = console_for_tables()
    console.print(_headline(document))
    for part in (
        _excitation(document),
        _errors(document),
        _sessions(document),
        _speeds(document),
        _parameters("Parameters", document.parameters),
        None if document.structured is None else _structured(document.structured),
        _eliminated(document),
        None if document.feasible is None else _feasible(document.feasible),
        None if document.prior is None else _prior(document.prior),
        _signals(document),
        _list("Not identifiable on this record", document.not_identifiable),
        _list("Remarks", document.remarks),
    ):
        if part is not None:
            console.print(Padding(part, (1, 0, 0, 0)))


def print_effects(catalogue: Iterable[CatalogueEffect]) -> None:
    """Print the catalogue of effects, group by group."""
    console = console_for_tables()
    groups: dict[str, list[CatalogueEffect]] = {}
    for effect in catalogue:
        groups.setdefault(effect.group, []).append(effect)
    for group, effects in groups.items():
        console.print(Text(group, style="bold underline"))
        for effect in effects:
            console.print(Text.assemble((effect.effect, "bold"), "   ", effect.equation))
            console.print(Padding(Text(effect.explanation), (0, 0, 0, 4)))
            if effect.needs:
                console.print(Padding(Text("needs " + "; ".join(effect.needs)), (0, 0, 0, 4)))
            if effect.indistinguishable_from:
                alike = "hard to tell from " + ", ".join(effect.indistinguishable_from)
                console.print(Padding(Text(alike, style="dim"), (0, 0, 0, 4)))
            console.print(Padding(Text(effect.source, style="dim"), (0, 0, 1, 4)))


def console_for_tables() -> Console:
    """The terminal, or a page wide enough where there is none."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(width=max(console.width, NARROWEST), highlight=False)


def _headline(document: IdentificationDocument) -> RenderableType:
    effects = {}
    for effect in document.effects:
        effects.setdefault(effect.effect, []).append(effect.joint)
    listed = ", ".join(f"{name} ({', '.join(joints)})" for name, joints in effects.items())
    fit = f"{document.samples} decimated samples, {document.estimator} least squares"
    if document.estimator in ("robust", "instrumental"):
        fit = f"{document.samples} decimated samples, {document.estimator} estimator"
    return Group(
        Text.assemble((document.experiment, "bold"), f": model {document.model}"),
        Text(f"effects: {listed}"),
        Text(f"{fit}; condition number {_number(document.condition_number, 3)}"),
    )


def _table(title: str, *columns: tuple[str, str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for name, side in columns:
        table.add_column(name, justify="right" if side == "right" else "left")
    return table


def _errors(document: IdentificationDocument) -> Table:
    table = _table(
        "Relative error ‖Y − Wχ‖ / ‖Y‖",
        ("joint", "left"),
        ("identification", "right"),
        ("validation", "right"),
        ("noise floor", "right"),
    )
    for joint in document.joints:
        figures = (joint.relative_error, joint.relative_error_validation, joint.noise_floor)
        table.add_row(joint.joint, *(_percent(figure) for figure in figures))
    whole = (document.relative_error, document.relative_error_validation)
    table.add_row(Text("all", style="bold"), *(_percent(figure) for figure in whole), "")
    return table


def _sessions(document: IdentificationDocument) -> Table:
    table = _table(
        "By session", ("session", "left"), ("payload", "left"), ("used for", "left"), ("error", "right")
    )
    for row in document.sessions:
        table.add_row(row.file, row.payload, row.role, _percent(row.relative_error))
    for left_out in document.excluded:
        table.add_row(left_out.file, left_out.payload, f"excluded: {left_out.reason}", "")
    if len(document.payloads) > 1:
        for row in document.payloads:
            table.add_row(
                Text("all with this payload", style="dim"),
                row.payload,
                row.role,
                _percent(row.relative_error),
            )
    return table


def _speeds(document: IdentificationDocument) -> Table:
    table = _table(
        "By speed",
        ("speed, of the maximum", "left"),
        ("identification", "right"),
        ("validation", "right"),
        ("samples", "right"),
    )
    for speed in document.speeds:
        span = f"{speed.range} ({100 * speed.from_:.0f} to {100 * speed.to:.0f} %)"
        errors = (speed.relative_error, speed.relative_error_validation)
        table.add_row(span, *(_percent(error) for error in errors), str(speed.samples))
    return table


def _parameters(title: str, parameters: Sequence[Parameter]) -> Table:
    table = _table(
        title,
        ("name", "left"),
        ("value", "right"),
        ("std", "right"),
        ("std, coloured", "right"),
        ("%", "right"),
        ("unit", "left"),
        ("joint", "left"),
        ("grouping", "left"),
    )
    for parameter in parameters:
        percent = parameter.relative_std_percent
        table.add_row(
            f"{parameter.name} (!)" if parameter.doubt else parameter.name,
            _number(parameter.value, 5),
            _number(parameter.std, 2),
            _number(parameter.std_robust, 2),
            "" if percent is None else f"{percent:.3g}",
            parameter.unit,
            parameter.joint,
            parameter.grouping if parameter.grouping not in (None, parameter.name) else "",
        )
    return table


def _excitation(document: IdentificationDocument) -> RenderableType | None:
    """What the motion does not tell, before any parameter is read."""
    excitation = document.excitation
    if excitation is None or excitation.verdict == "sufficient":
        return None
    title = "This motion does not determine all of the model"
    if excitation.verdict == "insufficient":
        title = "Do not rely on the parameters"
    return _list(title, excitation.cannot_tell)


def _structured(structured: StructuredEstimate) -> Table:
    error = _percent(structured.relative_error)
    title = f"One value for each physical parameter (relative error {error})"
    return _parameters(title, structured.parameters)


def _eliminated(document: IdentificationDocument) -> Table | None:
    if not document.eliminated:
        return None
    table = _table(
        "Eliminated, in this order",
        ("name", "left"),
        ("joint", "left"),
        ("deviation, % of value", "right"),
        ("error before", "right"),
        ("error after", "right"),
    )
    for parameter in document.eliminated:
        deviation = parameter.relative_std_percent
        errors = (parameter.relative_error_before, parameter.relative_error_after)
        table.add_row(
            parameter.name,
            parameter.joint,
            "" if deviation is None else f"{deviation:.3g}",
            *(_percent(error) for error in errors),
        )
    return table


def _feasible(feasible: FeasibleParameters) -> RenderableType:
    errors = (feasible.weighted_error_of_estimate, feasible.weighted_error_of_feasible)
    before, after = (_percent(error) for error in errors)
    table = _table(
        f"Nearest physically consistent base parameters (weighted error {before} becomes {after})",
        ("name", "left"),
        ("estimate", "right"),
        ("consistent", "right"),
        ("unit", "left"),
    )
    for parameter in feasible.base:
        table.add_row(
            parameter.name, _number(parameter.estimate, 5), _number(parameter.value, 5), parameter.unit
        )
    return table


def _prior(prior: PriorComparison) -> RenderableType:
    table = _table(
        f"By the bodies in {prior.file}",
        ("name", "left"),
        ("joint", "left"),
        ("by the file", "right"),
        ("identified", "right"),
        ("robust deviation", "right"),
        ("apart, deviations", "right"),
        ("unit", "left"),
    )
    for parameter in prior.parameters:
        apart = "rotor" if parameter.rotor else _number(parameter.deviations, 3)
        figures = (
            _number(parameter.by_file, 5),
            _number(parameter.identified, 5),
            _number(parameter.std_robust, 2),
            apart,
        )
        table.add_row(parameter.name, parameter.joint, *figures, parameter.unit)
    return Group(table, *(Text(f"  {remark}") for remark in prior.remarks))


def _signals(document: IdentificationDocument) -> Table:
    table = _table("Signals", ("setting", "left"), ("value", "right"), ("unit", "left"), ("why", "left"))
    for signal in document.signals:
        table.add_row(signal.name, _number(signal.value, 4), signal.unit, signal.reason)
    return table


def _list(title: str, lines: Sequence[str]) -> RenderableType | None:
    if not lines:
        return None
    return Group(Text(title, style="bold"), *(Text(f"  {line}") for line in lines))


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def _percent(value: float | None) -> str:
    return "—" if value is None else f"{100 * value:.2f} %"


def errors_of_models(models: Sequence[ModelErrors]) -> Table:
    """Table III for several models: relative errors in all, by joint, session and speed, one column for each model."""
    table = _table("Relative error", ("", "left"), *((document.model, "right") for document in models))

    def row(title: str, figures: Iterable[float | None]) -> None:
        listed = list(figures)
        if any(figure is not None for figure in listed):
            table.add_row(title, *(_percent(figure) for figure in listed))

    row("all sessions of the fit", (document.relative_error for document in models))
    row("validation sessions", (document.relative_error_validation for document in models))
    for index, speed in enumerate(models[0].speeds[1:], start=1):
        row(f"  {speed.range} speed", (document.speeds[index].relative_error for document in models))
    for index, joint in enumerate(models[0].joints):
        row(f"joint {joint.joint}", (document.joints[index].relative_error for document in models))
        checked = (document.joints[index].relative_error_validation for document in models)
        row("  on validation sessions", checked)
    for index, session in enumerate(models[0].sessions):
        title = f"{session.file}, payload {session.payload}"
        row(title, (document.sessions[index].relative_error for document in models))
    return table
