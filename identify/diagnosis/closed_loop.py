"""What an effect made of derivatives is worth when it is seen with instruments that disturbances do not reach.

In closed loop the measured motion answers the disturbance, so that a column made of its derivatives is correlated with
the noise of the torque: least squares then finds a delay where there is none, on unseen motion too, for every stretch
of the record has disturbances of its own. The estimate with instruments has no such bias. It decides whether there is
anything, and how much of the gain that least squares sees is the effect's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.evidence import joined_influences, wald_p_value
from identify.diagnosis.instruments import instrument_record
from identify.estimation.decimated_rows import decimated_rows
from identify.estimation.fitted_model import FittedModel
from identify.estimation.observation import Slot, block_edges, rows_of
from identify.estimation.reversal_noise import ReversalNoise

Array = NDArray[np.float64]
Index = NDArray[np.intp]

SINGULAR = 1e-9
"""Of unit columns and instruments: a direction that is seen less is not seen."""


@dataclass(frozen=True)
class LoopEvidence:
    """An effect as the instruments see it.

    estimates : of its parameters
    p_value   : probability of these, or larger ones, were there nothing
    part      : of the gain that least squares sees beside the model, what the estimates with instruments account for
    """

    estimates: Array
    p_value: float
    part: float


Asked = Callable[[int, Sequence[tuple[Candidate, int]]], list[LoopEvidence]]
"""Evidence for some candidates of a joint, each with the variant of its constants."""


def loop_evidence(
    fitted: FittedModel, noise: ReversalNoise, joint: int, listed: Sequence[tuple[Candidate, int]]
) -> list[LoopEvidence]:
    """Each of some candidates of a joint (with the variant of its constants) beside the rest of the fitted model."""
    asked = {candidate.term.key for candidate, _ in listed}
    slots = [
        slot
        for slot in fitted.slots
        if slot.term.key not in asked and joint in rows_of(fitted.record, slot.term)
    ]
    tested = [Slot.of(candidate.term, candidate.constants[variant]) for candidate, variant in listed]
    products = _products(fitted, joint, [*slots, *tested], noise)
    widths = [products.widths[slot] for slot in range(len(slots), len(slots) + len(tested))]
    base = np.arange(len(products.columns) - sum(widths))
    evidence, first = [], len(base)
    for width in widths:
        evidence.append(_judge(products, base, np.arange(first, first + width)))
        first += width
    return evidence


@dataclass(frozen=True)
class _Products:
    """ZᵀW and ZᵀY of every block of time, unit columns; WᵀW and WᵀY of all of them.

    widths : columns of every slot
    """

    cross: Array
    target: Array
    columns: Array
    measured: Array
    scale: Array
    sessions: Index
    widths: list[int]


def _products(fitted: FittedModel, joint: int, slots: Sequence[Slot], noise: ReversalNoise) -> _Products:
    record = fitted.record
    planned = instrument_record(record)
    sums: dict[tuple[int, int], list[Array]] = {}
    columns: Array | float = 0.0
    instruments: Array | float = 0.0
    widths: list[int] = []
    for session, entry in enumerate(fitted.entries):
        edges = block_edges(record, entry)
        rows = decimated_rows(record, entry, slots, fitted.torque, noise)
        other = decimated_rows(planned, entry, slots, fitted.torque)
        for seen, known in zip(rows, other, strict=True):
            widths = [len(place) for place in seen.table.slot_columns]
            place = np.clip(np.searchsorted(edges, seen.time, side="right") - 1, 0, len(edges) - 2)
            moving = seen.moving[:, joint]
            W, Z = seen.rows[joint][:, :-1], known.rows[joint][:, :-2]
            columns = columns + W[moving].T @ W[moving]
            instruments = instruments + np.sum(Z[moving] ** 2, axis=0)
            for number in np.unique(place[moving]):
                chosen = moving & (place == number)
                product = Z[chosen].T @ W[chosen]
                sums.setdefault((session, int(number)), []).append(product)
    blocks = sorted(sums)
    cross = np.array([np.sum(sums[block], axis=0) for block in blocks])
    whole = np.asarray(columns)
    scale = _norms(np.diag(whole)[:-1])
    unit = _norms(np.asarray(instruments))
    return _Products(
        cross[:, :, :-1] / np.outer(unit, scale),
        cross[:, :, -1] / unit,
        whole[:-1, :-1] / np.outer(scale, scale),
        whole[:-1, -1] / scale,
        scale,
        np.array([session for session, _ in blocks], np.intp),
        widths,
    )


def _norms(squares: Array) -> Array:
    return np.where(squares > 0, np.sqrt(np.maximum(squares, 0.0)), 1.0)


def _judge(products: _Products, base: Index, tested: Index) -> LoopEvidence:
    wanted = np.concatenate([base, tested])
    grid = np.ix_(wanted, wanted)
    cross = products.cross[:, *grid]
    target = products.target[:, wanted]
    inverse = np.linalg.pinv(cross.sum(0), rcond=SINGULAR)
    chi = inverse @ target.sum(0)
    influence = ((target - cross @ chi) @ inverse.T)[:, len(base) :]
    value = chi[len(base) :]
    inner = np.linalg.pinv(products.columns[np.ix_(base, base)], rcond=SINGULAR, hermitian=True)
    side = products.columns[np.ix_(base, tested)]
    left = products.columns[np.ix_(tested, tested)] - side.T @ inner @ side
    right = products.measured[tested] - side.T @ inner @ products.measured[base]
    plain = np.linalg.pinv(left, rcond=SINGULAR, hermitian=True) @ right
    seen = float(right @ plain)
    agree = float(plain @ left @ value) > 0
    part = min(1.0, float(value @ left @ value) / seen) if agree and seen > 0 else 0.0
    return LoopEvidence(
        value / products.scale[tested],
        wald_p_value(value, joined_influences(influence, products.sessions)),
        part,
    )
