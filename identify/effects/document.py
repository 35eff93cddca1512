"""The catalogue as a document for reading, `docs/effects.md`."""

from math import inf

from identify.effects.catalogue import built_in
from identify.effects.effect import Effect
from identify.effects.parameter import EffectParameter

HEADING = """# The catalogue of effects

Made by `coulomb effects --markdown` from the catalogue itself. Each effect is linear in its parameters once its nonlinear
constants are found; these are searched on the data, inside each fold of the cross-validation. Equation numbers are those of
Hamon, Gautier, Garrec (IROS 2010). `τ_out` is the load as the fitted model predicts it, never the measured torque.

An effect of your own is a YAML file that the experiment names under `effects:`

```yaml
name: lean-on-bumper
columns: ["max(0, q - edge)**1.5"]
constants:
  edge: {from: 0.3, to: 1.0, count: 15}
explanation: The arm leans on a rubber bumper. Check the end stops.
```

with the signals q, dq, ddq, load, torque, t, temp, direction (the sign of dq, without the noise at reversals), q1, q2, … (the
positions of all joints) and the functions sign, abs, exp, log, sqrt, sin, cos, tan, tanh, atan, min, max and
finite. A column that is no number somewhere (a root of what is negative, a quotient by 0) counts as 0 there, in fits and in
exports alike; `finite(x)` says so of a part of one. What the diagnosis
learns where the catalogue ends (`coulomb diagnose EXPERIMENT --keep-learned`) is such a file too. Or a subclass of
`identify.effects.effect.Effect` that an installed package offers under the entry point `coulomb.effects`
(`how-to/add-an-effect.md`). A parameter's range is that of the value as fitted; of a ratio that is its deviation from 1.
"""


def effects_document() -> str:
    """The document as Markdown, ending with a newline."""
    parts = [HEADING]
    groups: dict[str, list[Effect]] = {}
    for effect in built_in():
        groups.setdefault(effect.group, []).append(effect)
    for group, effects in groups.items():
        parts.append(f"## {group[0].upper()}{group[1:]}\n")
        for effect in effects:
            columns = "; ".join(f"`{text}`" for text in effect.regressors)
            parameters = ", ".join(_in_words(each) for each in effect.parameters)
            lines = [
                f"### `{effect.name}`: {effect.title}\n",
                f"{effect.explanation}\n",
                f"- Equation: `{effect.equation}`",
                f"- Columns: {columns}",
                f"- Parameters: {parameters}",
                f"- Needs: {', '.join(effect.needs) or 'nothing beyond motion'}",
                f"- May look like: {', '.join(f'`{name}`' for name in effect.confusable) or 'nothing else here'}",
                f"- Source: {effect.source}\n",
            ]
            parts.append("\n".join(lines))
    return "\n".join(parts).rstrip() + "\n"


def _in_words(parameter: EffectParameter) -> str:
    """Name, unit and range of a parameter."""
    bounds = ""
    if parameter.lower > -inf and parameter.upper < inf:
        bounds = f", {parameter.lower:g} to {parameter.upper:g}"
    elif parameter.lower > -inf:
        bounds = f", ≥ {parameter.lower:g}"
    elif parameter.upper < inf:
        bounds = f", ≤ {parameter.upper:g}"
    return f"{parameter.name} ({parameter.unit}{bounds})"
