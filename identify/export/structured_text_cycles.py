"""What a function block keeps from call to call for derivatives over time, which are known when the samples after them are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from identify.estimation.rigid_body import POSITION_STEP
from identify.export.exported_model import ExportedModel, Torque
from identify.export.expression_code import Dialect, literal, torque_text

RATE = """
FUNCTION {block}_RATE : LREAL
(* derivative over time at the middle one of three instants; of neighbours on both sides, or where one is no other, of one *)
VAR_INPUT
    T0, T1, T2, X0, X1, X2 : LREAL;
END_VAR
VAR
    A, B : LREAL;
END_VAR
A := T1 - T0;
B := T2 - T1;
IF (A > 0.0) AND (B > 0.0) THEN
    {block}_RATE := (X2 - X1) * A / (B * (A + B)) + (X1 - X0) * B / (A * (A + B));
ELSIF B > 0.0 THEN
    {block}_RATE := (X2 - X1) / B;
ELSIF A > 0.0 THEN
    {block}_RATE := (X1 - X0) / A;
ELSE
    {block}_RATE := 0.0;
END_IF;
END_FUNCTION
"""


@dataclass(frozen=True)
class Cycles:
    """Parts of the block.

    inputs, variables : declarations
    early, late       : statements after the torques of motion and load, and after those that are made of the whole torque
    dialect           : names of the signals at the instant that these last ones are of
    """

    inputs: str
    variables: str
    early: str
    late: str
    dialect: Dialect


def cycles_in_structured_text(model: ExportedModel, block: str, dialect: Dialect) -> Cycles:
    """Of a model with derivatives over time; the block's own torque is then that of `latency` calls before."""
    wait, wait_for_late = model.lags
    last = model.joints - 1
    of_motion, of_whole = model.in_order
    early, late = ([each for each in part if each.derivative] for part in (of_motion, of_whole))
    newest = 2 * wait
    then = replace(dialect, signals=_of_then(dialect)) if wait else dialect
    at_that_time = "".join(torque_text(model, each, then) for each in of_whole)
    signals = sorted(set(re.findall(r"\bWAS_(\w+)", at_that_time)))
    variables = [
        "NOW : LREAL;",
        f"CLOCK : ARRAY[0..{newest}] OF LREAL;",
        "RATES : ARRAY[0..2] OF LREAL;",
        f"SUMS : ARRAY[0..{wait}, 0..{last}] OF LREAL;",
    ]
    if early:
        variables.append(f"EARLY : ARRAY[0..{len(early) - 1}, 0..{newest}] OF LREAL;")
    for name in signals:
        highest = {"STATE": len(model.memories) - 1, "T": 0}.get(name, last)
        variables.append(f"WAS_{name} : ARRAY[0..{wait}, 0..{highest}] OF LREAL;")
    if late:
        variables += [
            "LATE_CLOCK : ARRAY[0..2] OF LREAL;",
            f"LATE : ARRAY[0..{len(late) - 1}, 0..2] OF LREAL;",
            f"SETTLED : ARRAY[0..1, 0..{last}] OF LREAL;",
        ]
    lines = ["NOW := SEL(BEGUN, 0.0, NOW + PERIOD);", *_kept("CLOCK[{}]", newest, "NOW")]
    for joint in range(model.joints):
        lines += _kept(f"SUMS[{{}}, {joint}]", wait, f"TORQUE[{joint}]")
    for name in signals:
        highest = {"STATE": len(model.memories) - 1, "T": 0}.get(name, last)
        for place in range(highest + 1):
            lines += _kept(f"WAS_{name}[{{}}, {place}]", wait, name if name == "T" else f"{name}[{place}]")
    for place, each in enumerate(early):
        lines.append(f"(* {each.effect} *)")
        lines += _kept(f"EARLY[{place}, {{}}]", newest, torque_text(model, each, dialect))
    lines += [f"TORQUE[{joint}] := SUMS[0, {joint}];" for joint in range(last + 1)]
    for place, each in enumerate(early):
        lines += _derivative(block, place, each)
    return Cycles(
        "    PERIOD : LREAL; (* s since the call before; it may change from call to call *)\n",
        "".join(f"    {line}\n" for line in variables),
        _text(lines),
        _text(_late_lines(model, block, late, then, wait)) if wait_for_late else "",
        then,
    )


def _of_then(dialect: Dialect) -> dict[str, str]:
    """Names of the signals as they were at the instant whose torque is known."""
    then = {}
    for signal, name in dialect.signals.items():
        array, bracket, index = name.partition("[")
        then[signal] = f"WAS_{array}[0, {index}" if bracket else f"WAS_{array}[0, 0]"
    return {**then, "torque": dialect.signals["torque"]}


def _kept(element: str, newest: int, value: str) -> Iterator[str]:
    """Statements that move the values of the last calls on and put the new one behind them; all are that one at first."""
    for place in range(newest):
        yield f"{element.format(place)} := SEL(BEGUN, {value}, {element.format(place + 1)});"
    yield f"{element.format(newest)} := {value};"


def _derivative(block: str, place: int, torque: Torque) -> Iterator[str]:
    for first in range(3):
        times = ", ".join(f"CLOCK[{first + step}]" for step in range(3))
        values = ", ".join(f"EARLY[{place}, {first + step}]" for step in range(3))
        yield f"RATES[{first}] := {block}_RATE({times}, {values});"
    rate = "RATES[1]"
    if torque.derivative == 2:
        rate = f"{block}_RATE(CLOCK[1], CLOCK[2], CLOCK[3], RATES[0], RATES[1], RATES[2])"
    yield f"TORQUE[{torque.row}] := TORQUE[{torque.row}] + {rate};"


def _late_lines(
    model: ExportedModel, block: str, late: Sequence[Torque], dialect: Dialect, wait: int
) -> Iterator[str]:
    yield from _kept("LATE_CLOCK[{}]", 2, f"CLOCK[{wait}]")
    for joint in range(model.joints):
        yield from _kept(f"SETTLED[{{}}, {joint}]", 1, f"TORQUE[{joint}]")
        yield f"TORQUE[{joint}] := SETTLED[0, {joint}];"
    for place, each in enumerate(late):
        yield f"(* {each.effect} *)"
        yield from _kept(f"LATE[{place}, {{}}]", 2, torque_text(model, each, dialect))
        values = ", ".join(f"LATE[{place}, {step}]" for step in range(3))
        yield (
            f"TORQUE[{each.row}] := TORQUE[{each.row}]"
            f" + {block}_RATE(LATE_CLOCK[0], LATE_CLOCK[1], LATE_CLOCK[2], {values});"
        )


def _text(lines) -> str:
    return "".join(f"{line}\n" for line in lines)


def passes_in_structured_text(model: ExportedModel, recursion: str) -> str:
    """The recursion, run with each joint that a slope is wanted of moved to both sides, with all at rest under gravity along
    the directions across it where their torque is wanted, and at last as it is."""
    if not (model.slopes or model.across):
        return recursion
    step, twice = literal(POSITION_STEP), literal(2 * POSITION_STEP)
    moves, results = [], []
    for place, joint in enumerate(model.slopes):
        for further, sign in ((0, "+"), (1, "-")):
            moves.append(
                f"IF PASS = {2 * place + further} THEN\n    MOVED[{joint}] := Q[{joint}] {sign} {step};\nEND_IF;"
            )
        results += [
            f"IF PASS = {2 * place} THEN\n    SLOPE[{joint}] := LOAD[{joint}];\nEND_IF;",
            f"IF PASS = {2 * place + 1} THEN\n    SLOPE[{joint}] := (SLOPE[{joint}] - LOAD[{joint}]) / {twice};\nEND_IF;",
        ]
    purposes = (
        ["with a joint moved to both sides, for the slope of its load over its position"] if moves else []
    )
    recursion = recursion.replace("* Q[J]", "* MOVED[J]")
    kept, last = "    MOVED[J] := Q[J];\n", 2 * len(model.slopes)
    if model.across:
        purposes.append("at rest, for the torque of gravity along two directions across it")
        for speed in ("DQ", "DDQ"):
            recursion = re.sub(rf"\b{speed}\[J\]", f"MOVED_{speed}[J]", recursion)
            kept += f"    MOVED_{speed}[J] := {speed}[J];\n"
        recursion = recursion.replace("-GRAVITY[K]", "-PULL[K]")
        moves.append("FOR K := 0 TO 2 DO\n    PULL[K] := GRAVITY[K];\nEND_FOR;")
        stop = "FOR J := 0 TO LAST DO\n    MOVED_DQ[J] := 0.0;\n    MOVED_DDQ[J] := 0.0;\nEND_FOR;"
        for name, direction in zip(("ACROSS_1", "ACROSS_2"), model.across, strict=True):
            pull = "\n".join(f"PULL[{k}] := {literal(float(value))};" for k, value in enumerate(direction))
            moves.append(f"IF PASS = {last} THEN\n{pull}\n{stop}\nEND_IF;")
            results.append(
                f"IF PASS = {last} THEN\nFOR J := 0 TO LAST DO\n    {name}[J] := LOAD[J];\nEND_FOR;\nEND_IF;"
            )
            last += 1
    head = (
        f"(* {'; '.join(purposes)}; at last as it is *)\n"
        f"FOR PASS := 0 TO {last} DO\nFOR J := 0 TO LAST DO\n{kept}END_FOR;\n"
    )
    return head + _text(moves) + recursion + _text(results) + "END_FOR;\n"
