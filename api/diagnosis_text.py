"""A diagnosis and its story as text for the terminal."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

SHOWN = 6
"""candidates shown for each joint; --json has all"""
VERDICTS = {
    "missing": "the model misses {effects}",
    "adequate": "the model is adequate: what is left is noise",
    "unexplained": "the model misses something that is in no catalogue",
}


def diagnosis_text(document: Mapping[str, Any]) -> str:
    """`diagnose --json` as text."""
    return "\n".join(_diagnosis_lines(document))


def _diagnosis_lines(document: Mapping[str, Any]) -> Iterator[str]:
    floor = document["noise_floor"]
    yield (
        f"{document['experiment']}, model {document['model']}: relative error {_percent(document['relative_error'])}"
        f" (noise floor {_percent(floor)})"
    )
    for joint in document["joints"]:
        effects = ", then ".join(joint["missing"])
        yield ""
        yield f"{joint['joint']}: {VERDICTS[joint['verdict']].format(effects=effects)}"
        yield f"  {'effect':26s} {'held out':>9s} {'with it':>9s} {'by chance':>10s}"
        for candidate in joint["candidates"][:SHOWN]:
            mark = "+" if candidate["effect"] in joint["missing"] else " "
            yield (
                f"{mark} {candidate['effect']:26s} {_percent(candidate['heldout_error_before']):>9s} "
                f"{_percent(candidate['heldout_error_after']):>9s} {candidate['p_value']:>10.1e}"
            )
            if candidate["indistinguishable_from"]:
                yield f"    cannot be told from {', '.join(candidate['indistinguishable_from'])}"
        if joint["missing"]:
            first = next(c for c in joint["candidates"] if c["effect"] == joint["missing"][0])
            yield from textwrap.wrap(first["explanation"], 100, initial_indent="  ", subsequent_indent="  ")
        for row in joint["where"][:2]:
            where = row.get("label") or f"{row['from']:.3g} to {row['to']:.3g}"
            yield f"  {row['share_of_error']:.0%} of the squared error lies at {row['variable']} {where}"
        if joint["superfluous"]:
            yield f"  terms that do not help: {', '.join(joint['superfluous'])}"


def improvement_text(document: Mapping[str, Any]) -> str:
    """`improve --json` as text."""
    lines = [f"{document['experiment']}, from the {document['model']} model:"]
    for number, step in enumerate(document["steps"]):
        added = step["added"]
        name = "start" if added is None else f"+ {added['effect']} ({added['joint']})"
        checked = step["relative_error_validation"]
        validation = "" if checked is None else f", on the validation sessions {_percent(checked)}"
        lines.append(f"  {number}. {name:40s} {_percent(step['relative_error']):>8s}{validation}")
    lines.append(f"Verdict: {document['verdict']}.")
    return "\n".join(lines)


def _percent(value: float | None) -> str:
    return "unknown" if value is None else f"{100 * value:.2f} %"
