"""What data an effect needs: each condition with the words of the catalogue and the one test whether they are there.

A plan, a page and a diagnosis ask the same conditions, through `Effect.obstacle`; each of its facts comes from the
summary of a record or of planned motion.
"""

from collections.abc import Callable
from dataclasses import dataclass

from identify.effects.coverage import FAST, SLOW
from identify.effects.motion import TEMPERATURE_CHANGE, JointSummary

ENOUGH = 0.02
"""of the moving time that must be spent somewhere (slow, in a quadrant, …) to say that it is covered"""

EITHER_WAY = 0.2
"""of the moving time in each direction, without which the directions cannot be compared"""

WIDE = 0.5
"""of the position range: below, springs and position-dependent friction hide behind gravity"""

NOTHING_SLOWER = 0.35
"""of the top speed: where nearly all samples are faster, friction at low speed has no column of its own"""

WARM_UP = 60.0
"""s that a session must last so that friction can be seen to fall; a plan for as long is some hundredths shorter"""


@dataclass(frozen=True)
class Obstacle:
    """Why data do not show an effect.

    reason : in words
    remedy : what would show it; None where no data of this machine would
    prevents : whether nothing of the effect is in the data, so that it is not tried; otherwise there is too little to
               rely on, which a plan should mend and a diagnosis tries all the same
    """

    reason: str
    remedy: str | None
    prevents: bool = True


def _untested(summary: JointSummary) -> Obstacle | None:
    return None


@dataclass(frozen=True)
class Condition:
    """What an effect needs to be seen.

    need : in words, for the catalogue
    obstacle : why a record or plan does not have it; None where it does, or where its summary cannot tell
    """

    need: str
    obstacle: Callable[[JointSummary], Obstacle | None] = _untested


def _slow(summary: JointSummary) -> Obstacle | None:
    coverage = summary.coverage
    if coverage is None or min(coverage.slow_forwards, coverage.slow_backwards) >= ENOUGH:
        return None
    return Obstacle(
        f"no slow motion (below {SLOW:.0%} of the top speed, both ways)",
        "give the plan more seconds",
        prevents=False,
    )


def _stribeck_speeds(summary: JointSummary) -> Obstacle | None:
    if summary.speed_quantiles[2] > NOTHING_SLOWER * summary.maximum_speed:
        return Obstacle(
            "no slow motion: hardly a sample is below a third of the top speed", "give the plan more seconds"
        )
    return _slow(summary)


def _fast(summary: JointSummary) -> Obstacle | None:
    coverage = summary.coverage
    if coverage is None or coverage.fast is None or coverage.fast >= ENOUGH:
        return None
    return Obstacle(
        f"no fast motion (above {FAST:.0%} of the speed limit)",
        "give the joint more room or acceleration",
        prevents=False,
    )


def _either_way(summary: JointSummary) -> Obstacle | None:
    coverage = summary.coverage
    if coverage is None or min(coverage.forwards, coverage.backwards) >= EITHER_WAY:
        return None
    return Obstacle("a direction that is hardly driven", "drive the joint both ways alike", prevents=False)


def _load_change(summary: JointSummary) -> Obstacle | None:
    if summary.load_changes:
        return None
    remedy = "run sessions with and without a payload"
    if summary.axis_along_gravity:
        return Obstacle("no payload change and no gravity on the joint", remedy, prevents=False)
    return Obstacle("no payload change", remedy, prevents=False)


def _load_change_at_low_speed(summary: JointSummary) -> Obstacle | None:
    obstacle = _load_change(summary)
    if obstacle is None or not summary.axis_along_gravity:
        return obstacle
    # what is left is inertia, which loads the joint only while its speed changes: not in slow motion
    return Obstacle(obstacle.reason, obstacle.remedy)


def _quadrants(summary: JointSummary) -> Obstacle | None:
    coverage = summary.coverage
    if coverage is None or coverage.quadrants is None:
        return None
    empty = [str(number) for number, share in enumerate(coverage.quadrants, start=1) if share < ENOUGH]
    if not empty:
        return None
    return Obstacle(
        f"hardly any motion in quadrant{'s' if len(empty) > 1 else ''} {', '.join(empty)} of speed and load",
        "widen the position limits so that gravity loads the joint both ways, or mount a payload",
        prevents=False,
    )


def _wide(summary: JointSummary) -> Obstacle | None:
    coverage = summary.coverage
    if coverage is None or coverage.position_share is None or coverage.position_share >= WIDE:
        return None
    return Obstacle(
        f"only {coverage.position_share:.0%} of the position range", "widen the motion", prevents=False
    )


def _warm_up(summary: JointSummary) -> Obstacle | None:
    if summary.coverage is None or max(summary.session_durations) >= 0.95 * WARM_UP:
        return None
    return Obstacle(
        f"a session of {max(summary.session_durations):.0f} s only",
        f"plan at least {WARM_UP:.0f} s",
        prevents=False,
    )


def _temperature(summary: JointSummary) -> Obstacle | None:
    if summary.has_temperature:
        return None
    return Obstacle(
        f"no temperature column that changes by more than {TEMPERATURE_CHANGE:.0f} K",
        "set record_temperature in the rig file where the drive reports one",
    )


def _payload(summary: JointSummary) -> Obstacle | None:
    if summary.loaded_sessions:
        return None
    return Obstacle("no session with a payload", "plan a session with a weighed payload")


def _known_load_or_sessions(summary: JointSummary) -> Obstacle | None:
    if summary.loaded_sessions or summary.has_external_force or len(summary.sessions) > 1:
        return None
    return Obstacle(
        "no known load, neither a weighed payload nor a measured external force",
        "plan a session with a weighed payload",
    )


def _several_sessions(summary: JointSummary) -> Obstacle | None:
    if len(summary.sessions) > 1:
        return None
    return Obstacle("one session alone: a constant of its own is the offset", "record a second session")


def _shared_motor(summary: JointSummary) -> Obstacle | None:
    if summary.coupled_motors:
        return None
    return Obstacle("the motor acts on this joint alone: its inertia and friction are the joint's own", None)


def _joint_before(summary: JointSummary) -> Obstacle | None:
    if summary.joint_before is not None:
        return None
    if summary.joint == 0:
        return Obstacle(
            "it is the first joint: there is none before it that it could share a motor with", None
        )
    return Obstacle(
        "the speed of the joint before it cannot be added to its own: one slides and the other turns, or the drive gain matrix"
        " says which motor they share",
        None,
    )


SLOW_MOTION = Condition("slow motion", _slow)
STRIBECK_SPEEDS = Condition("slow motion", _stribeck_speeds)
FAST_MOTION = Condition("fast motion", _fast)
BOTH_DIRECTIONS = Condition("motion in both directions", _either_way)
LOAD_CHANGE = Condition("a payload change or strongly varying gravity load", _load_change)
LOAD_CHANGE_AT_LOW_SPEED = Condition(
    "a payload change or strongly varying gravity load", _load_change_at_low_speed
)
ALL_QUADRANTS = Condition("all four quadrants of Fig. 2", _quadrants)
WIDE_RANGE = Condition("motion over a wide range of positions", _wide)
LONG_SESSION = Condition("a session of a minute or more", _warm_up)
TEMPERATURE = Condition("a temperature column that changes by some kelvin", _temperature)
KNOWN_PAYLOAD = Condition("a session with a known payload", _payload)
KNOWN_LOAD_OR_SESSIONS = Condition(
    "a known payload or a known external force, or several sessions", _known_load_or_sessions
)
SEVERAL_SESSIONS = Condition("several sessions", _several_sessions)
SHARED_MOTOR = Condition("a drive gain matrix with off-diagonal terms", _shared_motor)
JOINT_BEFORE = Condition("a joint before it of the same kind, and motion of both", _joint_before)
ENCODER_ON_THE_MOTOR = Condition("an encoder on the motor's side")
