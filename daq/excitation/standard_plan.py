"""A plan for a rig of which nothing is known but its limits: a ladder of speeds, then repeated sums of
sinusoids.
"""

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import SAMPLING
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.speed_ladder import Reach, speed_ladder
from daq.excitation.trapezoid import Dwell, Move, move_at
from daq.rig import Rig
from identify.recording.errors import InputError

HARMONICS = 5
"""harmonics of a sum of sinusoids, as usual for robot excitation (Swevers et al. 1997, reference 2 of the
paper)
"""

REPEATS = 3
"""periods: two would give a noise floor, the third gives it an uncertainty"""

REST = 0.5
"""s at rest before and after: offsets of the position show"""


def standard_plan(rig: Rig, seconds: float, seed: int = 0, name: str = "standard") -> ExcitationPlan:
    """A plan of at most `seconds` within the rig's limits: 60 % of the time on the ladder, the rest on
    sinusoids.

    Raises InputError where the time is too short.
    """
    if not seconds > 2.0 * REST:
        raise InputError(f"seconds: a plan needs more than {2.0 * REST:g} s, not {seconds:g}")
    reach = Reach.of(rig)
    centre = reach.middle
    active = seconds - 2.0 * REST
    ladder = speed_ladder(reach, centre, 0.6 * active, seed)
    left = active - sum(move.duration for move in ladder)
    phases: list[Dwell | Move | Sinusoids] = [Dwell(duration=REST), *ladder]
    if left >= 4.0:
        phases.append(sum_of_sinusoids(reach, left, random_shape(len(centre), seed)))
    phases.append(Dwell(duration=REST))
    plan = ExcitationPlan(
        name=name,
        rig=rig.name,
        joints=tuple(axis.joint for axis in rig.axes),
        start=tuple(float(x) for x in centre),
        phases=tuple(phases),
    )
    if plan.duration > seconds + 1e-6:
        raise InputError(
            f"seconds: within these limits the shortest plan lasts {plan.duration:.1f} s, not {seconds:g}"
        )
    return plan


def random_shape(axes: int, seed: int) -> Array:
    """(2, n, harmonics): cosine and sine amplitudes of random phase; the higher the harmonic the smaller."""
    random = np.random.default_rng(seed)
    phase = random.uniform(0.0, 2.0 * np.pi, size=(axes, HARMONICS))
    amplitude = 1.0 / np.arange(1, HARMONICS + 1)
    return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase)])


def sum_of_sinusoids(reach: Reach, seconds: float, shape: Array) -> Sinusoids:
    """Repeated harmonics of a given shape (2, n, harmonics), as large as the limits allow, lasting `seconds`.

    The fades take a tenth of the time each; every joint is scaled to its first limit and centred in its
    range.
    """
    fade = 0.1 * seconds
    frequency = REPEATS / (seconds - 2.0 * fade)
    unscaled = Sinusoids(
        frequency=frequency,
        repeats=REPEATS,
        fade=fade,
        centre=(0.0,) * shape.shape[1],
        cosine=tuple(map(tuple, shape[0].tolist())),
        sine=tuple(map(tuple, shape[1].tolist())),
    )
    time = np.arange(0.0, unscaled.duration, SAMPLING)
    terms = unscaled.evaluate(time, np.zeros(shape.shape[1]))
    allowed = (0.5 * (reach.high - reach.low), reach.velocity, reach.acceleration, reach.jerk)
    share = np.min(
        [limit / np.abs(term).max(axis=0) for limit, term in zip(allowed, terms, strict=True)], axis=0
    )
    scaled = shape * share[np.newaxis, :, np.newaxis]
    return unscaled.model_copy(
        update={
            "centre": tuple(reach.middle.tolist()),
            "cosine": tuple(map(tuple, scaled[0].tolist())),
            "sine": tuple(map(tuple, scaled[1].tolist())),
        }
    )


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
