"""A plan made for a model: the ladder and the sinusoids whose regressor judged most about its parameters.

Searched are the split of the time, the order of the ladder's places and directions, and the centres,
amplitudes and phases of the sinusoids. Every candidate is first stretched to the rig's limits, so that no
constraint has to be searched for. The search is Rechenberg's (1+1) evolution strategy with his rule of one
success in five: the goal has kinks where another limit becomes the first one, which gradients do not like.
It is seeded and counts evaluations, not seconds: the same request gives the same plan.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.information import Information, information
from daq.excitation.plan_model import PlanModel, PlannedMotion
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.speed_ladder import Reach
from daq.excitation.standard_plan import Recipe, random_shape, sum_of_sinusoids
from daq.rig import Rig
from identify.recording.experiment_file import Payload

CRITERIA = ("d-optimal", "condition")
"""what is made large: the information's determinant, or small: the condition number"""

LADDER_SHARES = (0.45, 0.6, 0.75, 0.88)
"""of the time; the rest is for sinusoids"""

LADDER_SEEDS = 6
"""orders of places and directions that are compared; one joint has few that differ"""

EVALUATIONS = 400
"""of the search for the sinusoids"""

FIRST_STEP, SMALLEST_STEP = 0.3, 1e-3
"""of the search, in units of the first harmonic's amplitude; below the smallest it starts afresh"""

WIDEST_CENTRE = 0.7
"""of half the range: how far from its middle a joint may swing"""

COARSE = 0.08
"""s between samples while ladders are compared: a quarter of the shortest stay at a constant speed"""

SAMPLES_PER_HARMONIC = 16
"""samples in a period of the highest harmonic while sinusoids are searched for"""

FINE = 0.02
"""s between samples of the final judgement"""


@dataclass(frozen=True)
class Request:
    """What is asked of the planner."""

    rig: Rig
    model: PlanModel
    payloads: tuple[Payload, ...]
    """one session each"""
    seconds: float
    """of each session"""
    noise: Array
    """(n,) N m, standard deviation of the filtered joint torque"""
    criterion: str = "d-optimal"
    """one of CRITERIA"""
    seed: int = 0
    dynamic_share: float = 1.0
    """of the limits on velocity, acceleration and jerk that may be used; lowered where the current limit
    asks for it
    """


def information_of(plan: ExcitationPlan, request: Request, period: float = FINE) -> Information:
    """Information of one session of the plan with each payload."""
    first = PlannedMotion.of(plan, request.payloads[0], period)
    motions = [replace(first, payload=payload) for payload in request.payloads]
    return information(request.model, motions, request.noise)


def optimal_plan(request: Request, progress: Callable[[float, str], None] | None = None) -> ExcitationPlan:
    """The best plan found within the limits and the time.

    Raises InputError where the time is too short.
    """
    say = progress or _no_progress
    reach = Reach.of(request.rig, dynamic_share=request.dynamic_share)
    name = f"{request.model.name} {request.seconds:g} s"
    recipes = [
        Recipe(ladder_share=share, seed=request.seed + seed)
        for share in LADDER_SHARES
        for seed in range(LADDER_SEEDS)
    ]
    plans: list[ExcitationPlan] = []
    judged: list[Information] = []
    for number, recipe in enumerate(recipes):
        plans.append(recipe.build(request.rig, reach, request.seconds, name))
        judged.append(information_of(plans[-1], request, COARSE))
        say(0.2 * (number + 1) / len(recipes), "comparing ladders of speeds")
    scale = np.max([each.scale for each in judged], axis=0)
    scores = [score(each, request.criterion, scale) for each in judged]
    best = int(np.argmax(scores))
    recipe = _with_better_sinusoids(recipes[best], plans[best], request, reach, scale, say)
    plan = recipe.build(request.rig, reach, request.seconds, name)
    if score(information_of(plan, request, COARSE), request.criterion, scale) < scores[best]:
        plan = plans[best]
    return plan.model_copy(update={"model": request.model.name})


def _no_progress(fraction: float, step: str) -> None:
    """Where nobody asked for progress."""


def score(judged: Information, criterion: str, scale: Array) -> float:
    """What is maximised: ln det of the information, or minus the logarithm of the condition number."""
    if criterion == "d-optimal":
        return judged.log_determinant(scale)
    eigenvalues = np.linalg.eigvalsh(judged.correlated)
    return float(0.5 * np.log(max(eigenvalues[0], 1e-12) / eigenvalues[-1]))


def _with_better_sinusoids(
    recipe: Recipe,
    plan: ExcitationPlan,
    request: Request,
    reach: Reach,
    scale: Array,
    say: Callable[[float, str], None],
) -> Recipe:
    """The recipe with sinusoids searched for; as it is where there is no time for any."""
    swinging = next((phase for phase in plan.phases if isinstance(phase, Sinusoids)), None)
    if swinging is None:
        return recipe
    seconds = swinging.duration
    ladder = plan.model_copy(
        update={"phases": tuple(phase for phase in plan.phases if not isinstance(phase, Sinusoids))}
    )
    rest = information_of(ladder, request, COARSE)
    n = len(plan.joints)
    random = np.random.default_rng(request.seed)

    def recipe_of(x: Array) -> Recipe:
        return replace(recipe, centre=WIDEST_CENTRE * np.tanh(x[:n]), shape=x[n:].reshape(2, n, -1))

    def goal(x: Array) -> float:
        trial = recipe_of(x)
        assert trial.shape is not None
        assert trial.centre is not None
        phase = sum_of_sinusoids(reach, seconds, trial.shape, trial.centre)
        motions = one_period(phase, request.payloads)
        once = information(request.model, motions, request.noise)
        return score(rest + Information(phase.repeats * once.matrix), request.criterion, scale)

    x = np.concatenate([np.zeros(n), random_shape(n, recipe.seed).ravel()])
    best, step = goal(x), FIRST_STEP
    for count in range(EVALUATIONS):
        trial = x + step * random.standard_normal(len(x))
        reached = goal(trial)
        if reached > best:
            x, best, step = trial, reached, step * 1.5
        else:
            step *= 1.5**-0.25
        if step < SMALLEST_STEP:
            step = FIRST_STEP
        say(0.2 + 0.8 * (count + 1) / EVALUATIONS, "searching for the best sinusoids")
    return recipe_of(x)


def one_period(phase: Sinusoids, payloads: tuple[Payload, ...]) -> list[PlannedMotion]:
    """The motion that repeats, once, with every payload; all share the same arrays."""
    begin, _ = phase.repeated
    count = SAMPLES_PER_HARMONIC * len(phase.cosine[0])
    step = 1.0 / (phase.frequency * count)
    time = begin + step * (np.arange(float(count)) + 0.5)
    q, dq, ddq, _ = phase.evaluate(time, np.array(phase.centre))
    return [PlannedMotion(payload, time, q, dq, ddq, step) for payload in payloads]
