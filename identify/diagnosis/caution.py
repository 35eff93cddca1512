"""What a record cannot tell of an effect even where it shows it.

Without a change of payload the load of a joint is its own weight and inertia. It follows position and acceleration, and
its scale is estimated from the same torque; the paper's conclusion asks for different loads at low velocities.
"""

from collections.abc import Mapping

from identify.effects.effect import Effect
from identify.effects.motion import JointSummary


def load_siblings(effect: Effect, known: Mapping[str, Effect], summary: JointSummary) -> tuple[str, ...]:
    """Effects that only a change of load would tell from this one; none where the load changes."""
    if summary.load_changes:
        return ()
    if effect.group == "load":
        return tuple(name for name in effect.confusable if name in known)
    return tuple(
        other.name for other in known.values() if other.group == "load" and effect.name in other.confusable
    )


def caution(effect: Effect, known: Mapping[str, Effect], summary: JointSummary) -> str | None:
    """What must be kept in mind when this effect is named; None where the record tells all of it."""
    if summary.load_changes:
        return None
    if effect.group == "load":
        return (
            "It rests on the arm's own weight and inertia alone, which follow position and acceleration and whose scale is "
            "estimated from the same torque. That friction follows the load, and how much, cannot be known without a "
            "change of payload. Run a session with another payload."
        )
    siblings = load_siblings(effect, known, summary)
    if siblings:
        return (
            f"Whether this friction grows with the load ({', '.join(siblings)}) cannot be known without a change of "
            "payload. Run a session with another payload."
        )
    return None
