"""Fitting a model: choosing nonlinear constants, and letting the load of load-dependent effects follow
the fit.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.effects.catalogue import KnownEffects
from identify.effects.model import Model, Term
from identify.effects.motion import JointSummary
from identify.effects.payload_errors import PayloadMass
from identify.estimation import forked
from identify.estimation.constrained import admissible_columns, admissible_fit
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import LeastSquares, least_squares
from identify.estimation.observation import FittedTorque, Observation, Slot, observe
from identify.estimation.record import Record
from identify.estimation.triangular_factor import TriangularFactor
from identify.recording import InputError, SessionEntry

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

RANK = 1e-10
"""Eigenvalue of a matrix of products of unit columns, in parts of the largest, below which it counts as zero."""

MOST_SWEEPS = 3
"""Times that the constants of all terms are chosen one after the other. Of 51 searches on three measured machines (TX40, EMPS,
the Dynamixel) the second sweep changed a choice in 4, the third in none."""

LOAD_ROUNDS = 3
"""Passes in which the load of load-dependent effects is taken from the last fit; chi moves by less than a
tenth of its deviation in the third."""


def payload_ratio_term(record: Record, model: Model, entries: Sequence[SessionEntry]) -> Term | None:
    """The payload ratio M_ae/M_aw of eq. (35), estimated beside every model that does not treat it itself."""
    if any(term.effect.replaces_payload_ratio(dict(term.constants or ())) for term in model.terms):
        return None
    if not any(entry.payload.mass > 0 for entry in entries):
        return None
    return Term(KnownEffects()[PayloadMass.name], 0)


def fit_model(
    record: Record,
    model: Model,
    entries: Sequence[SessionEntry] | None = None,
    payload_ratio: bool = True,
    load_from: FittedTorque | None = None,
    inertial: bool = True,
    refine: bool = False,
    progress: Progress | None = None,
    start: FittedModel | None = None,
) -> FittedModel:
    """Fit a model to sessions (the identification sessions if not said).

    payload_ratio : estimate M_ae/M_aw of every payload beside the model (eq. 35); otherwise take it as
    declared
    load_from     : a fitted model whose load is used throughout, instead of one that follows the fit
    refine        : search around the constants that the model's terms have, instead of keeping them
    start         : a fitted model that this one widens: the load of the first pass, so that no term added fits worse
    inertial      : whether the base parameters' own columns take part; eq. (30) replaces them
    Raises InputError: no joint moves in these sessions, or all torques are zero while they do.
    """
    chosen = list(record.entries() if entries is None else entries)
    ratio = payload_ratio_term(record, model, chosen) if payload_ratio else None
    terms = [*model.terms, *([ratio] if ratio else [])]
    loaded = any(term.effect.uses_load or term.effect.from_residual for term in model.terms)
    open_terms = [term for term in terms if refine or term.constants is None]
    open_constants = any(len(t.effect.grid(record.summaries[t.joint])) > 1 for t in open_terms)
    summaries = record.summaries
    rounds = 1 + (LOAD_ROUNDS if loaded and load_from is None else int(open_constants))
    fitted = load_from or (None if start is None else start.torque)
    # What is found in a residual waits for the others that follow the load: beside a drive gain that is not fitted yet, no
    # ripple stands out, though the diagnosis found it once the gain was in the model.
    waiting = [term for term in open_terms if term.effect.from_residual] if fitted is None else []
    if not any(not _without_load(term) for term in terms if term not in waiting):
        waiting = []
    rounds += bool(waiting)
    if start is not None:
        rounds = max(1, rounds - 1)
        summaries = _informed(start) if loaded else summaries
    settled: dict[tuple[str, int], dict[str, float]] = {
        t.key: dict(t.constants) for t in terms if t.constants is not None
    }
    fixed = set() if refine else set(settled)
    result: FittedModel | None = None
    best: FittedModel | None = None
    last: FittedModel | None = None
    for index in range(rounds):
        if progress:
            progress(index / rounds, f"pass {index + 1} of {rounds} over the samples")
        active = [term for term in terms if fitted is not None or not loaded or _without_load(term)]
        if waiting and index == 1:
            active = [term for term in active if term not in waiting]
        if (
            start is None
            and 1 <= index <= 1 + bool(waiting)
            and any(term.effect.uses_load or term.effect.from_residual for term in open_terms)
        ):
            summaries = _informed(result)
        variants = [_variants(term, settled, fixed, summaries[term.joint]) for term in active]
        slots = [
            Slot.of(t, constants)
            for t, choices in zip(active, variants, strict=True)
            for constants in choices
        ]
        if last is not None and list(last.slots) == slots and fitted and fitted.same_as(last.load_from):
            observation = last.observation
        else:
            observation = observe(record, chosen, slots, fitted, by_joint=True)
        starts = [_place(choices, settled.get(t.key)) for t, choices in zip(active, variants, strict=True)]
        picked = choose_constants(observation, variants, inertial, starts)
        searched = observation
        narrowed: dict[tuple[int, ...], Observation] = {}
        fit_of = partial(_fit_chosen, searched, variants, narrowed, inertial, summaries)
        # what the search found best without bounds need not be best inside them; mostly both are asked for
        at_once = [picked, starts] if picked != starts and forked.dividing() > 1 else [picked]
        fit, *others = forked.each(fit_of, at_once, kept=True)
        _require_torque_in_motion(record, chosen, fit)
        if fit.free is not None and picked != starts:
            kept = others[0] if others else fit_of(starts)
            if _left(kept) < _left(fit):
                fit, picked = kept, starts
        observation = narrowed.get(tuple(picked)) or _chosen(searched, variants, picked)
        for term, choices, pick in zip(active, variants, picked, strict=True):
            settled[term.key] = choices[pick]
        result = FittedModel(
            record,
            model.with_constants([t.chosen(settled[t.key]) for t in model.terms if t.key in settled]),
            tuple(observation.slots),
            tuple(chosen),
            observation,
            fit,
            fitted,
            ratio is not None,
        )
        last = result if load_from is not None else result.with_own_load()
        # Nothing makes the next pass better than the last. On the TX40's wrist, where the friction of one gear is in the
        # load of the other, whole steps go back and forth between 7 and 18 % of the torque; half a step ends at 7 %.
        worse = best is not None and _left(last.fit) > _left(best.fit)
        followed = last.torque.half_way_from(fitted) if worse and fitted is not None else last.torque
        fitted = load_from or followed
        if len(active) == len(terms) and not worse:
            best = last
    assert best is not None  # the last round has all terms
    return best


def searched_anew(record: Record, model: Model) -> FittedModel:
    """A model with all its constants searched from the beginning, and then around what was found."""
    searched = [
        replace(term, constants=None) if len(term.effect.grid(record.summaries[term.joint])) > 1 else term
        for term in model.terms
    ]
    coarse = fit_model(record, model.with_constants(searched))
    return fit_model(record, coarse.model, refine=True, start=coarse)


def _require_torque_in_motion(record: Record, entries: Sequence[SessionEntry], fit: LeastSquares) -> None:
    """Raises InputError: there is nothing to fit, so that no relative error is defined."""
    if fit.norm.any():
        return
    sessions = f"{entries[0].path}{f' and {len(entries) - 1} more' if len(entries) > 1 else ''}"
    if not fit.rows.any():
        raise InputError(f"{sessions}: no joint moves, so there is nothing to identify; record a motion")
    columns = "column 'v1' is" if record.joints == 1 else f"columns 'v1' to 'v{record.joints}' are"
    raise InputError(f"{sessions}: {columns} zero wherever a joint moves: no torque of a motion was recorded")


def _left(fit: LeastSquares) -> float:
    """Sum over the joints of the squared relative error."""
    norm = np.where(fit.norm > 0, fit.norm, 1.0)
    return float(np.sum((fit.residual / norm) ** 2))


def _chosen(
    observation: Observation, variants: Sequence[Sequence[dict[str, float]]], picked: Sequence[int]
) -> Observation:
    """The observation with the columns of one choice of each term's constants."""
    if not any(len(choices) > 1 for choices in variants):
        return observation
    firsts = np.concatenate([[0], np.cumsum([len(choices) for choices in variants])])[:-1]
    return only_slots(observation, [int(s) + p for s, p in zip(firsts, picked, strict=True)])


def _fit_chosen(
    observation: Observation,
    variants: Sequence[Sequence[dict[str, float]]],
    narrowed: dict[tuple[int, ...], Observation],
    inertial: bool,
    summaries: Sequence[JointSummary],
    picked: Sequence[int],
) -> LeastSquares:
    """The fit with one choice of each term's constants, its parameters inside what they can be.

    narrowed : gets the observation with the columns of that choice
    """
    observation = narrowed[tuple(picked)] = _chosen(observation, variants, picked)
    if not inertial:
        return least_squares(observation, np.arange(observation.base, observation.width))
    fit = least_squares(observation)
    return admissible_fit(observation, fit, admissible_columns(observation, summaries))


def _without_load(term: Term) -> bool:
    """Whether a term's columns can be had before anything is fitted."""
    effect = term.effect
    return effect.known_beforehand or not (effect.uses_load or effect.from_residual)


def _informed(result: FittedModel | None) -> list[JointSummary]:
    """The joints' summaries with what the first fit tells."""
    assert result is not None  # asked for after the first pass only
    # Imported where needed: only effects found in the residual ask for it, and the usual model has none.
    from identify.estimation.informed_summary import informed_summaries

    return informed_summaries(result)


def _variants(
    term: Term,
    settled: dict[tuple[str, int], dict[str, float]],
    fixed: set[tuple[str, int]],
    summary: JointSummary,
) -> list[dict[str, float]]:
    """Constants to try for a term in this pass: coarse at first, then around the choice.

    Raises InputError: what a first fit leaves shows nothing that the effect could be searched in.
    """
    if term.key in fixed:
        return [settled[term.key]]
    if term.key in settled:
        return term.effect.refine(settled[term.key], summary)
    choices = term.effect.grid(summary)
    if not choices:
        reason = term.effect.prevented(summary) or "there is nothing to search"
        raise InputError(f"{term.effect.name}@{summary.name}: this record cannot show it: {reason}")
    return choices


def choose_constants(
    observation: Observation,
    variants: Sequence[Sequence[dict[str, float]]],
    inertial: bool = True,
    starts_at: Sequence[int] | None = None,
) -> list[int]:
    """For every term the variant of its constants with the least residual, one term after the other until none changes.

    starts_at : the variants that the search starts from, so that it never ends at a worse fit than theirs; the middle
                ones if not given

    All variants' columns are projected off those of the model once for each term; a variant is then a problem of as
    many unknowns as it has columns.
    """
    starts = np.concatenate([[0], np.cumsum([len(choices) for choices in variants])]).astype(int)
    picked = [len(choices) // 2 for choices in variants] if starts_at is None else list(starts_at)
    several = [index for index, choices in enumerate(variants) if len(choices) > 1]
    if not several:
        return picked
    base = np.arange(observation.base if inertial else 0)

    def columns_of(terms: Sequence[int]) -> NDArray[np.intp]:
        slots = [observation.slot_columns[starts[i] + picked[i]] for i in terms]
        return np.concatenate([base, *slots]).astype(np.intp)

    weights = least_squares(observation, columns_of(range(len(variants)))).weights
    products = _weighted_products(observation, weights)
    # most second sweeps find the other terms as the first left them
    known: dict[tuple[int, bytes], tuple[Array, float]] = {}
    for _ in range(MOST_SWEEPS if len(several) > 1 else 1):
        before = list(picked)
        for index in several:
            others = columns_of([i for i in range(len(variants)) if i != index])
            options = [observation.slot_columns[starts[index] + o] for o in range(len(variants[index]))]
            asked = index, others.tobytes()
            if asked not in known:
                known[asked] = _explained(products, others, options)
            explained, left = known[asked]
            widths = np.array([len(option) for option in options])
            # With the widest choice all joints' weighted residuals are about equal.
            price = column_price(left, explained, len(observation.blocks), len(observation.joint_columns))
            picked[index] = int(np.argmax(explained - price * widths))
        if picked == before:
            break
    return picked


def column_price(left: float, explained: Array, blocks: int, joints: int = 1) -> float:
    """Squared residual that a further column must take away to be worth having, among choices of different width.

    Mallows' C_p: the noise is what the widest choice leaves, and each block of time counts as one independent observation,
    whatever the colour of the residual, so that choices with more columns are not preferred for fitting noise (C. L.
    Mallows, "Some comments on C_p", Technometrics 15(4), 1973). What is left without the columns would ask more of an
    effect the stronger it is.

    left      : squared residual without any of the choices
    explained : (choices,) how much of it each takes away
    joints    : number of joints that the residual is the sum over
    """
    return 2.0 * max(left - float(explained.max()), 0.0) / joints / max(blocks, 1)


def _place(choices: Sequence[dict[str, float]], present: dict[str, float] | None) -> int:
    """Index of the present constants among those to try; the middle where there are none."""
    return choices.index(present) if present in choices else len(choices) // 2


def _weighted_products(observation: Observation, weights: Array) -> Array:
    """[W Y]ᵀ[W Y] over all joints' weighted rows, columns brought to unit norm; Y is the last."""
    width = observation.width
    products = np.zeros((width + 1, width + 1))
    for joint, columns in enumerate(observation.joint_columns):
        rows = observation.merged(joint).r[:, :-1]
        place = np.append(columns, width)
        products[np.ix_(place, place)] += weights[joint] ** 2 * (rows.T @ rows)
    norm = np.sqrt(np.diag(products))
    return products / np.outer(np.where(norm > 0, norm, 1.0), np.where(norm > 0, norm, 1.0))


def _explained(
    products: Array, others: NDArray[np.intp], options: Sequence[NDArray[np.intp]]
) -> tuple[Array, float]:
    """How much of the squared residual of `others` each group of further columns explains, and that residual."""
    wanted = np.concatenate([*options, [len(products) - 1]]).astype(np.intp)
    inner = np.linalg.pinv(products[np.ix_(others, others)], rcond=RANK, hermitian=True)
    cross = products[np.ix_(others, wanted)]
    left = products[np.ix_(wanted, wanted)] - cross.T @ inner @ cross
    counts = np.array([len(option) for option in options])
    starts = np.cumsum(counts) - counts
    explained = np.zeros(len(options))
    for width in np.unique(counts[counts > 0]):
        chosen = np.flatnonzero(counts == width)
        places = starts[chosen][:, None] + np.arange(width)
        gram, target = left[places[:, :, None], places[:, None, :]], left[places, -1]
        inverse = np.linalg.pinv(gram, rcond=RANK, hermitian=True)
        explained[chosen] = np.einsum("oi,oij,oj->o", target, inverse, target)
    return explained, float(left[-1, -1])


def only_slots(observation: Observation, slots: Sequence[int]) -> Observation:
    """The observation with some of its slots, columns renumbered."""
    kept = [observation.slot_columns[slot] for slot in slots]
    old = np.concatenate([np.arange(observation.base), *kept]).astype(np.intp)
    new = np.full(observation.width, -1, np.intp)
    new[old] = np.arange(len(old))
    joint_columns, factors = [], [[] for _ in observation.blocks]
    for joint, columns in enumerate(observation.joint_columns):
        present = np.flatnonzero(new[columns] >= 0)
        joint_columns.append(new[columns[present]])
        pick = np.concatenate([present, [len(columns), len(columns) + 1]])
        for block, rows in enumerate(observation.stacked(joint).of_blocks(pick)):
            factors[block].append(TriangularFactor(rows, observation.factors[block][joint].rows))
    starts = np.concatenate(
        [[observation.base], observation.base + np.cumsum([len(k) for k in kept])]
    ).astype(int)
    return replace(
        observation,
        slots=[observation.slots[slot] for slot in slots],
        slot_columns=[np.arange(starts[i], starts[i + 1]) for i in range(len(kept))],
        joint_columns=joint_columns,
        factors=factors,
        _whole={},
        _stacked={},
    )
