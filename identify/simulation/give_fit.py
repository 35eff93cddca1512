"""How transmissions give, from the torque of two masses: the equation of motion that a simulation integrates.

The columns of elasticity and backlash are of the first order in what gives: they take the load of the measured motion for what
the gear carries. That tells the effects, but what a rollout integrates has links that swing and fly behind their motors
(`driven_link.py`). Here the torque of such links is taken instead of the columns, and what gives is searched for the least error
of it, the linear parameters being those of least squares beside it (Golub, Pereyra 1973, SIAM J. Numer. Anal. 10). Samples,
filters, weights and bounds are those of the fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.dry_friction import Coulomb
from identify.effects.effect import Simulated
from identify.effects.give import Give
from identify.estimation.context import Slot
from identify.estimation.decimated_rows import DecimatedRows, decimated_rows
from identify.estimation.fitted_model import FittedModel
from identify.recording import SessionEntry
from identify.signals import MotionBlock
from identify.simulation.driven_link import DrivenLink, driven_link
from identify.simulation.give_equation import GiveEquation, Stretch
from identify.simulation.give_range import LEAST_ON_LINK, PARTS_ON_LINK, GiveRange

Array = NDArray[np.float64]
Hidden = Mapping[str, tuple[float, float]]
"""by a session's file the part of it, s, that a fit does not see"""

ROUNDS = 2
"""passes in which links are driven by the load of the last; parameters move by parts of a thousandth in the second"""

SEARCHES = 3
"""for friction on the link, from the best beginnings: a gap that is met at other instants is another minimum"""

MOST_TRIALS = 12
"""steps of the search in one pass; it ends by itself after three to ten"""


@dataclass(frozen=True, eq=False)
class GiveFit:
    """A fitted model whose joints give.

    fitted : the model, its linear parameters those beside the gives; columns of what gives have none
    gives  : by joint
    """

    fitted: FittedModel
    gives: Mapping[int, Give]


def give_fit(fitted: FittedModel, hidden: Hidden | None = None, begun: GiveFit | None = None) -> GiveFit:
    """Fit what gives in a model on the sessions that it was fitted to.

    hidden : parts of sessions to leave out
    begun  : of the same effects, whose gives the search begins with, and whose links have dry friction where these do
    Joints that have no inertia in the model (eq. 30 in its linear form) give nothing.
    """
    sought = giving_slots(fitted)
    if not sought:
        return GiveFit(fitted, {})
    if hidden is None:
        kept = fitted.held.get("gives")
        if isinstance(kept, GiveFit):
            return kept
    given = _fit(fitted, sought, hidden or {}, begun.gives if begun else None)
    if hidden is None:
        fitted.held["gives"] = given
    return given


def giving_slots(fitted: FittedModel) -> list[Slot]:
    """The effects of a model that give between motor and link; a gap whose columns are pushed by motion too."""
    return [slot for slot in fitted.slots if slot.term.effect.gives is not None]


def formed_as(slot: Slot, gives: Mapping[int, Give]) -> Simulated:
    """How a simulation forms the torque of an effect, of joints that give as told.

    Where a model has no inertia that motor and link could share, a gap pushed by motion keeps the law of its columns.
    """
    gives_way = slot.term.effect.gives is not None and slot.term.joint in gives
    return "give" if gives_way else slot.term.effect.simulated_with(slot.values)


def _fit(
    fitted: FittedModel, sought: Sequence[Slot], hidden: Hidden, begun: Mapping[int, Give] | None = None
) -> GiveFit:
    observation, base = fitted.observation, fitted.observation.base
    numbered = zip(fitted.slots, observation.slot_columns, strict=True)
    giving = np.concatenate([columns for slot, columns in numbered if slot in sought])
    kept = np.setdiff1d(fitted.fit.fitted, giving)
    joints = sorted({slot.term.joint for slot in sought})
    chi = fitted.fit.chi
    stretches = _stretches(fitted, chi[:base], joints, hidden)
    dry = _dry_friction(fitted)
    ranges: dict[int, GiveRange] = {}
    for number, joint in enumerate(joints):
        reach = _range_of(fitted, [stretch.links[number] for stretch, _ in stretches], sought)
        if reach is not None:
            ranges[joint] = reach
    if len(ranges) < len(joints):
        able = [slot for slot in sought if slot.term.joint in ranges]
        rest = _fit(fitted, able, hidden, begun) if able else GiveFit(fitted, {})
        return GiveFit(_with_values(rest.fitted, rest.fitted.fit.chi, giving), rest.gives)
    listed = list(ranges.values())
    equation = GiveEquation(fitted, kept, stretches)
    if begun is None:
        chosen = [each.starts()[0] for each in listed]
        for number, each in enumerate(listed):
            chosen = _by_joint(listed, _best_first(equation, listed, chosen, number, each.starts())[0])
        values = _searched(equation, listed, np.concatenate(chosen))
        for number, joint in enumerate(joints):
            if joint in dry:
                listed, values = _with_friction_on_link(equation, listed, values, (number, dry[joint]))
    else:
        known = [begun[joint] for joint in joints]
        listed = [
            replace(each, dry=dry.get(joint, 0.0) if give.link_dry else 0.0)
            for each, joint, give in zip(listed, joints, known, strict=True)
        ]
        values = np.concatenate([each.values(give) for each, give in zip(listed, known, strict=True)])
    for last in range(ROUNDS - 1, -1, -1):
        if not last:
            values = _searched(equation, listed, values)
        chi = np.zeros(observation.width)
        chi[kept] = equation.linear(_gives(listed, values))
        if last:
            equation = GiveEquation(fitted, kept, _stretches(fitted, chi[:base], joints, hidden))
    gives = _gives(listed, values)
    given = _with_values(fitted, chi, giving)
    left = equation.deviations(gives) * np.sqrt(fitted.fit.rows)
    given = replace(given, fit=replace(given.fit, residual=left))
    return GiveFit(given, dict(zip(joints, gives, strict=True)))


def _with_values(fitted: FittedModel, chi: Array, giving: NDArray[np.intp]) -> FittedModel:
    """The model with other linear parameters, none of them of what gives."""
    chi = chi.copy()
    chi[giving] = 0.0
    return replace(fitted, fit=replace(fitted.fit, chi=chi, free=None))


def _stretches(
    fitted: FittedModel, chi: Array, joints: Sequence[int], hidden: Hidden
) -> list[tuple[Stretch, DecimatedRows]]:
    """The blocks of all sessions of a fit with the links of the joints that give, base parameters chi."""
    listed = []
    for entry in fitted.entries:
        begin, end = hidden.get(entry.file, (np.inf, -np.inf))
        rigid = _rigid(fitted, entry, chi)
        blocks = fitted.record.blocks(entry)
        rows_of_blocks = decimated_rows(fitted.record, entry, fitted.slots, fitted.load_from)
        for prepared, rows in zip(blocks, rows_of_blocks, strict=True):
            block = prepared.block
            edge = max(1, block.first // 2)
            inner = slice(edge, len(block.time) - edge)
            # samples whose filter reaches into the left-out ends tell nothing of the links
            reach = 2 * block.first * block.sampling_period
            seen = (rows.time >= block.time[0] + reach) & (rows.time <= block.time[-1] - reach)
            seen &= (rows.time < begin) | (rows.time > end)
            links = [_driven(rigid, block, inner, joint) for joint in joints]
            listed.append((Stretch(block, inner, links, rows.moving & seen[:, None]), rows))
    return listed


def _rigid(fitted: FittedModel, entry: SessionEntry, chi: Array) -> InverseDynamics:
    base = fitted.record.body.base
    payload = np.zeros(PARAMETERS_PER_JOINT * fitted.record.joints)
    payload[-PARAMETERS_PER_JOINT:-1] = payload_parameters(entry.payload)
    return InverseDynamics(base.geometry, [base.nearest_standard(chi) + payload])


def _driven(rigid: InverseDynamics, block: MotionBlock, rows: slice, joint: int) -> DrivenLink:
    """What drives the link of a joint over some rows of a block."""
    dq = block.dq[rows]

    def loads(q: Array, ddq: Array) -> Array:
        load = rigid.torques(q, dq, ddq)[0]
        return load if block.external is None else load - block.external[rows]

    return driven_link(joint, block.sampling_period, (block.q[rows], dq, block.ddq[rows]), loads)


def _range_of(fitted: FittedModel, links: Sequence[DrivenLink], sought: Sequence[Slot]) -> GiveRange | None:
    """What the give of a joint can be; None where the model has no inertia or no load there."""
    joint = links[0].joint
    inertia = min(float(np.min(link.inertias[:, joint])) for link in links)
    load = max(float(np.max(np.abs(link.load))) for link in links)
    if inertia <= 0.0 or load <= 0.0:
        return None
    summary = fitted.record.summaries[joint]
    kinds = {slot.term.effect.gives for slot in sought if slot.term.joint == joint}
    return GiveRange(
        inertia,
        load,
        summary.span,
        summary.position_resolution,
        spring="spring" in kinds,
        gap="gap" in kinds,
    )


def _gives(ranges: Sequence[GiveRange], values: Array) -> list[Give]:
    return [each.give(part) for each, part in zip(ranges, _by_joint(ranges, values), strict=True)]


def _dry_friction(fitted: FittedModel) -> dict[int, float]:
    """N m or N, by joint: the constant dry friction of a model, of joints that have some."""
    numbered = zip(fitted.slots, fitted.observation.slot_columns, strict=True)
    dry_of_joint = {
        slot.term.joint: float(fitted.fit.chi[columns[0]])
        for slot, columns in numbered
        if isinstance(slot.term.effect, Coulomb)
    }
    return {joint: dry for joint, dry in dry_of_joint.items() if dry > 0.0}


def _with_friction_on_link(
    equation: GiveEquation, ranges: Sequence[GiveRange], values: Array, joint: tuple[int, float]
) -> tuple[list[GiveRange], Array]:
    """Ranges and values with a part of a joint's dry friction on its link, or without where the torque does not call for it.

    joint : place among those that give, and its dry friction, N m or N
    Both are searched from where the other ends, so that neither is the better for its beginning alone.
    """
    number, dry = joint
    rubbing = list(ranges)
    rubbing[number] = replace(ranges[number], dry=dry)
    present = _by_joint(ranges, values)
    starts = [*(np.append(present[number], part) for part in PARTS_ON_LINK), *rubbing[number].starts()]
    listed = _best_first(equation, rubbing, present, number, starts)
    best, least = _best_of(
        equation, rubbing, [_searched(equation, rubbing, each) for each in listed[:SEARCHES]]
    )
    free = _by_joint(rubbing, best)
    free[number] = free[number][:-1]
    smooth, without = _best_of(equation, ranges, [values, _searched(equation, ranges, np.concatenate(free))])
    # each second of the record counts as one sample, whatever the noise of those within it has in common
    called_for = equation.seconds * np.log(without / least) > np.log(equation.seconds)
    if called_for and _by_joint(rubbing, best)[number][-1] >= LEAST_ON_LINK:
        return rubbing, best
    return list(ranges), smooth


def _best_of(
    equation: GiveEquation, ranges: Sequence[GiveRange], listed: Sequence[Array]
) -> tuple[Array, float]:
    """Of some values those with the least error, and its square."""
    squares = [float(np.sum(equation.residual(_gives(ranges, each)) ** 2)) for each in listed]
    best = int(np.argmin(squares))
    return listed[best], squares[best]


def _by_joint(ranges: Sequence[GiveRange], values: Array) -> list[Array]:
    """The values of each joint."""
    return np.split(values, np.cumsum([len(each.lower) for each in ranges])[:-1])


def _best_first(
    equation: GiveEquation,
    ranges: Sequence[GiveRange],
    chosen: Sequence[Array],
    number: int,
    starts: Sequence[Array],
) -> list[Array]:
    """Values of all joints with some of one joint's beside the others' `chosen`, those with the least error first."""
    listed = [np.concatenate([*chosen[:number], start, *chosen[number + 1 :]]) for start in starts]
    errors = [np.linalg.norm(equation.residual(_gives(ranges, each))) for each in listed]
    return [listed[place] for place in np.argsort(errors, kind="stable")]


def _searched(equation: GiveEquation, ranges: Sequence[GiveRange], values: Array) -> Array:
    """The values with the least error, from some to begin with."""
    from scipy.optimize import least_squares

    lower = np.concatenate([each.lower for each in ranges])
    upper = np.concatenate([each.upper for each in ranges])
    margin = 1e-6 * (upper - lower)
    search = least_squares(
        lambda tried: equation.residual(_gives(ranges, tried)),
        np.clip(values, lower + margin, upper - margin),
        bounds=(lower, upper),
        x_scale=0.1,
        diff_step=1e-3,
        max_nfev=MOST_TRIALS,
        xtol=1e-4,
        ftol=1e-5,
    )
    return np.asarray(search.x)
