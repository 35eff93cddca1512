"""A plan for a rig of which nothing is known but its limits: a ladder of speeds, then repeated sums of
sinusoids.
"""

import math
from dataclasses import dataclass

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.speed_ladder import Reach, speed_ladder
from daq.excitation.trapezoid import Dwell, Move, move_at
from daq.rig import Rig
from identify.recording.errors import InputError

HARMONICS = 5
"""harmonics of a sum of sinusoids, as usual for robot excitation (Swevers et al. 1997, reference 2 of the
paper)
"""

FEWEST_REPEATS = 3
"""periods: two would give a noise floor, the third gives it an uncertainty"""

LONGEST_PERIOD = 8.0
"""s: a longer fundamental would leave five harmonics too slow to excite inertia"""

SHORTEST_SINUSOIDS = 4.0
"""s: in less time no three periods are worth having"""

LONGEST = 3600.0
"""s: what a motion of that length records is held in memory at once"""

REST = 0.5
"""s at rest before and after: offsets of the position show"""


@dataclass(frozen=True)
class Recipe:
    """Everything that distinguishes one plan from another once limits and time are given."""

    ladder_share: float = 0.6
    """of the time that goes to the ladder of speeds; the rest is for sinusoids"""
    seed: int = 0
    """of the order of places and directions on the ladder"""
    shape: Array | None = None
    """(2, n, harmonics): cosine and sine amplitudes, up to a factor per joint; random phases where None"""
    centre: Array | None = None
    """(n,) -1..1: about where in its range each joint swings; the middle where None"""

    def build(self, rig: Rig, reach: Reach, seconds: float, name: str = "standard") -> ExcitationPlan:
        """The plan, stretched to the limits.

        Raises InputError where the time is too short.
        """
        if not seconds > 2.0 * REST:
            raise InputError(f"seconds: a plan needs more than {2.0 * REST:g} s, not {seconds:g}")
        if seconds > LONGEST:
            raise InputError(f"seconds: a plan lasts at most {LONGEST:g} s, not {seconds:g}")
        n = len(rig.axes)
        shape = random_shape(n, self.seed) if self.shape is None else self.shape
        centre = np.zeros(n) if self.centre is None else self.centre
        swing_about = reach.middle + 0.5 * (reach.high - reach.low) * centre
        active = seconds - 2.0 * REST
        ladder = speed_ladder(reach, swing_about, self.ladder_share * active, self.seed)
        left = active - sum(move.duration for move in ladder)
        phases: list[Dwell | Move | Sinusoids] = [Dwell(duration=REST), *ladder]
        if left >= SHORTEST_SINUSOIDS:
            phases.append(sum_of_sinusoids(reach, left, shape, centre))
        phases.append(Dwell(duration=REST))
        plan = ExcitationPlan(
            name=name,
            rig=rig.name,
            joints=tuple(axis.joint for axis in rig.axes),
            start=tuple(swing_about.tolist()),
            phases=tuple(phases),
        )
        if plan.duration > seconds + 1e-6:
            shortest = math.ceil(10 * plan.duration) / 10
            raise InputError(
                f"seconds: within these limits the shortest plan lasts {shortest:.1f} s, not {seconds:g}"
            )
        return plan


def standard_plan(rig: Rig, seconds: float, seed: int = 0, name: str = "standard") -> ExcitationPlan:
    """A plan of at most `seconds` within the rig's limits, made for no model in particular.

    Raises InputError where the time is too short.
    """
    return Recipe(seed=seed).build(rig, Reach.of(rig), seconds, name)


def random_shape(axes: int, seed: int) -> Array:
    """(2, n, harmonics): cosine and sine amplitudes of random phase; the higher the harmonic the smaller."""
    random = np.random.default_rng(seed)
    phase = random.uniform(0.0, 2.0 * np.pi, size=(axes, HARMONICS))
    amplitude = 1.0 / np.arange(1, HARMONICS + 1)
    return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase)])


def sum_of_sinusoids(reach: Reach, seconds: float, shape: Array, centre: Array) -> Sinusoids:
    """Repeated harmonics of a given shape (2, n, harmonics), as large as the limits allow, lasting `seconds`.

    centre : (n,) -1..1 in the range; a joint that swings off the middle has less room. Every joint is
    scaled to the first limit that it meets; the fades take at most a tenth of the time each.
    """
    repeats = max(FEWEST_REPEATS, int(np.ceil(0.9 * seconds / LONGEST_PERIOD)))
    fade = min(0.1 * seconds, 0.5 * seconds / (repeats + 1))
    half = 0.5 * (reach.high - reach.low)
    axes: int = shape.shape[1]
    unscaled = Sinusoids(
        frequency=repeats / (seconds - 2.0 * fade),
        repeats=repeats,
        fade=fade,
        centre=(0.0,) * axes,
        cosine=tuple(tuple(row) for row in shape[0].tolist()),
        sine=tuple(tuple(row) for row in shape[1].tolist()),
    )
    terms = unscaled.evaluate(peak_times(unscaled), np.zeros(axes))
    allowed = (half * (1.0 - np.abs(centre)), reach.velocity, reach.acceleration, reach.jerk)
    share = np.min(
        [limit / np.abs(term).max(axis=0) for limit, term in zip(allowed, terms, strict=True)], axis=0
    )
    scaled = shape * (PEAK_MARGIN * share[np.newaxis, :, np.newaxis])
    return unscaled.model_copy(
        update={
            "centre": tuple((reach.middle + half * centre).tolist()),
            "cosine": tuple(tuple(row) for row in scaled[0].tolist()),
            "sine": tuple(tuple(row) for row in scaled[1].tolist()),
        }
    )


PEAK_SAMPLES = 24
"""per period of the highest harmonic: a peak between two of them is missed by less than (π/24)²/2 of that
harmonic
"""

PEAK_MARGIN = 1.0 - 0.5 * (np.pi / PEAK_SAMPLES) ** 2
"""by which peaks between the samples may be higher"""


def peak_times(phase: Sinusoids) -> Array:
    """s: the fade-in, one period and the fade-out, sampled closely enough to find the peaks."""
    harmonics = len(phase.cosine[0])
    step = 1.0 / (phase.frequency * harmonics * PEAK_SAMPLES)
    begin, end = phase.repeated
    first = np.arange(0.0, begin + 1.0 / phase.frequency, step)
    last = np.arange(end, phase.duration, step)
    return np.concatenate([first, last, [phase.duration]])


def approach(rig: Rig, here: Array, to: Array, share: float = 0.2) -> ExcitationPlan | None:
    """A slow synchronous move from where the joints are to where a plan starts; None where they are there.

    share : of the limits on velocity and acceleration that the approach uses
    """
    here, to = np.asarray(here, dtype=float), np.asarray(to, dtype=float)
    if np.abs(to - here).max() < 1e-6:
        return None
    reach = Reach.of(rig)
    move = move_at(here, to, share * reach.velocity, share * reach.acceleration, share * reach.jerk)
    return ExcitationPlan(
        name="approach",
        rig=rig.name,
        joints=tuple(axis.joint for axis in rig.axes),
        start=tuple(here.tolist()),
        phases=(move,),
    )
