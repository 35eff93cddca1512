"""The load-velocity model with one value for each physical parameter.

The linear form (30) has products a_m·J, b_m·MX …, one set for each quadrant pair, although there is one arm only.
Here the parameters are those of the arm, once (J, MX …), and of each joint's gear, once (a_m, b_m, a_g, b_g, c_m,
d_m, c_g, d_g, F_V, offset). The coefficients of the columns of (30) are products of two of them, so the estimate is
a nonlinear least squares problem on the same triangular factors, solved by Levenberg and Marquardt's method.

Without a known load (a weighed payload, a measured external force) nothing tells the arm's scale from the gear's
a_m and a_g: then a_m = 1 + alpha and a_g = 1 - alpha, the same loss both ways.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.load_velocity import LoadVelocity
from identify.effects.model import Term
from identify.effects.transmission import MotorInertia
from identify.estimation.context import FittedTorque, Slot
from identify.estimation.estimate import Estimate, with_parameters
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import LeastSquares, joint_rows, least_squares
from identify.estimation.observation import Observation, observe
from identify.estimation.parameters import rotor_name, slot_names
from identify.estimation.statistics import deviation_from_blocks

Array = NDArray[np.float64]

GEAR = ("a_m", "b_m", "a_g", "b_g", "c_m", "d_m", "c_g", "d_g")
MOST_STEPS = 60
CONVERGED = 1e-7
"""relative fall of the sum of squares below which the search stops"""
POWER_SIGN_ROUNDS = 3
"""how often P⁺ and P⁻ are taken anew from the fitted load"""
KNOWN_LOAD = 1e-6
"""norm of a known load's column, in parts of the torque's, from which on it counts"""
NOT_SEEN = 1e-6
"""part of a parameter's own effect that those of the others leave; below, the data do not tell it"""
NOTHING_SAID = 1 / np.sqrt(12)
"""deviation of a share that may be anything from 0 to 1: data that leave as much say nothing of it"""
NOT_TOLD = {
    ("b_m", "b_g"): "how the load's share of friction changes at low speed",
    ("a_m", "a_g"): "how friction grows with the load",
}
"""shares of a gear's load that are held where data do not tell them, in the order in which they are given up"""


@dataclass(frozen=True, eq=False)
class StructuredFit:
    """The structured estimate.

    form    : how the parameters make the coefficients of (30)
    theta   : the parameters as `form` orders them
    fitted  : the columns of (30) with the coefficients that the physical parameters make, so that it predicts
    names   : (name, joint, unit, grouping) of every physical parameter
    values, std, std_robust : of them; NaN deviations where the data do not tell the parameter
    tied    : joints without a known load, for which a_m + a_g = 2
    held    : names of parameters that the motion does not tell, held where a gear has no such friction
    untold  : joint and what its motion does not tell, in words
    """

    form: "_Form"
    theta: Array
    fitted: FittedModel
    names: tuple[tuple[str, str, str, str | None], ...]
    values: Array
    std: Array
    std_robust: Array
    tied: tuple[str, ...]
    held: frozenset[str] = frozenset()
    untold: tuple[tuple[str, str], ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the reader must know."""
        remarks = [
            f"{joint}: the motion does not tell {', '.join(what for name, what in self.untold if name == joint)};"
            " the structured estimate leaves it out"
            for joint in dict.fromkeys(name for name, _ in self.untold)
        ]
        if self.tied:
            remarks.append(
                f"no known load on {', '.join(self.tied)}: the structured estimate takes a_m + a_g = 2 there"
                " (the same loss both ways)"
            )
        return tuple(remarks)


class _Form:
    """How the physical parameters make the coefficients of the columns of (30)."""

    def __init__(self, linear: FittedModel) -> None:
        record, observation = linear.record, linear.observation
        base = record.body.base
        self.base, self.width = observation.base, observation.width
        size = np.array([float(np.linalg.norm(observation.merged(j).r[:, -1])) for j in range(record.joints)])
        self.names: list[tuple[str, str, str, str | None]] = list(
            zip(base.names, base.joints, base.units, base.groupings, strict=True)
        )
        self.rotors: dict[int, int] = {}
        """place of the rotor's inertia of each shared motor, which is in the load of its gear beside the base parameters"""
        for motor in record.body.shared_motors:
            self.rotors[motor] = len(self.names)
            name, unit = rotor_name(motor)
            self.names.append((name, record.joint_names[motor], unit, None))
        self.start = [0.0] * len(self.names)
        self.gears: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], bool]] = []
        """for each gear: columns of (30), places of what it carries, places of its own parameters, tied"""
        self.others: list[tuple[int, int]] = []
        """(column, place) of the columns that stand for themselves"""
        self.tied: list[str] = []
        self.held: list[int] = []
        """places of parameters that stay where they are"""
        self.untold: list[tuple[str, str]] = []
        listed = zip(linear.slots, observation.slot_columns, strict=True)
        for slot, columns in listed:
            joint = slot.term.joint
            name = record.joint_names[joint]
            if not isinstance(slot.term.effect, LoadVelocity):
                self._add_others(linear, slot, columns)
                continue
            inertial = record.body.gear_parameters(joint)
            if joint in self.rotors:
                inertial = np.append(inertial, self.rotors[joint])
            known = columns[len(inertial)]
            place = np.flatnonzero(observation.joint_columns[joint] == known)
            norm = float(np.linalg.norm(observation.merged(joint).r[:, place]))
            tied = norm <= KNOWN_LOAD * size[joint]
            if tied:
                self.tied.append(name)
            unit = "N m" if record.summaries[joint].revolute else "N"
            suffix = "" if record.joints == 1 else f"@{name}"
            places = []
            for symbol in GEAR:
                if tied and symbol == "a_g":
                    places.append(places[0])
                    continue
                places.append(len(self.names))
                self.names.append((symbol + suffix, name, "1" if symbol[0] in "ab" else unit, None))
                self.start.append(0.0)
            self.gears.append((columns, inertial.astype(np.intp), np.array(places, np.intp), tied))

    def _add_others(self, linear: FittedModel, slot: Slot, columns: NDArray[np.intp]) -> None:
        for column, name in zip(
            columns, slot_names(linear.record, slot.term, slot.values, len(columns)), strict=True
        ):
            self.others.append((int(column), len(self.names)))
            self.names.append(name)
            self.start.append(float(linear.fit.chi[column]))

    def begin(self, load: FittedTorque, linear: FittedModel) -> Array:
        """Parameters to start from: the arm of the load that the power sign came from, a gear without loss."""
        theta = np.array(self.start)
        theta[: self.base] = load.chi
        for motor, place in self.rotors.items():
            theta[place] = load.rotor(motor)
        for columns, inertial, places, tied in self.gears:
            theta[places[0]] = 0.0 if tied else 1.0
            if not tied:
                theta[places[2]] = 1.0
            theta[places[4:]] = linear.fit.chi[columns[4 * (len(inertial) + 1) :]]
        return theta

    def load(self, theta: Array) -> FittedTorque:
        """The arm and the rotors, which the power sign is taken from."""
        rotors = [(Slot.of(Term(MotorInertia(), motor)), place) for motor, place in self.rotors.items()]
        return FittedTorque(theta[: self.base], tuple((slot, theta[[place]]) for slot, place in rotors))

    def coefficients(self, theta: Array) -> tuple[Array, Array]:
        """(width,) coefficients of the columns and (width, parameters) their derivatives."""
        chi = np.zeros(self.width)
        slope = np.zeros((self.width, len(theta)))
        for column, place in self.others:
            chi[column], slope[column, place] = theta[place], 1.0
        for columns, inertial, places, tied in self.gears:
            arm = theta[inertial]
            for group in range(4):
                block = columns[group * (len(inertial) + 1) : (group + 1) * (len(inertial) + 1)]
                place, sign, start = places[group], 1.0, 0.0
                if group in (0, 2) and tied:
                    sign, start = (1.0 if group == 0 else -1.0), 1.0
                factor = start + sign * theta[place]
                chi[block[:-1]] = factor * arm
                chi[block[-1]] = factor - (1.0 if group in (0, 2) else 0.0)
                slope[block[:-1], inertial] = factor
                slope[block[:-1], place] = sign * arm
                slope[block[-1], place] = sign
            dry = columns[4 * (len(inertial) + 1) :]
            chi[dry] = theta[places[4:]]
            slope[dry, places[4:]] = 1.0
        slope[:, self.held] = 0.0
        return chi, slope

    def hold(self, theta: Array, deviations: Array) -> Array | None:
        """Hold of every gear the first shares of the load that the data say nothing of; the parameters then, or None where
        nothing is left to hold.

        deviations : (parameters,) that hold for coloured residuals; NaN where nothing at all is seen
        """
        held = theta.copy()
        before = len(self.held)
        for *_, places, tied in self.gears:
            for symbols, untold in NOT_TOLD.items():
                shares = np.unique([places[GEAR.index(symbol)] for symbol in symbols])
                if np.isin(shares, self.held).all() or np.all(deviations[shares] < NOTHING_SAID):
                    continue
                self.held += shares.tolist()
                self.untold.append((self.names[shares[0]][1], untold))
                held[shares] = 1.0 if symbols == ("a_m", "a_g") and not tied else 0.0
                break
        return held if len(self.held) > before else None

    def reported(self, theta: Array, std: Array, robust: Array) -> tuple[list, Array, Array, Array]:
        """Names, values and deviations for the reader: a tied joint's a_m and a_g both."""
        names, values, deviations, robusts = list(self.names), theta.copy(), std.copy(), robust.copy()
        added = 0
        for _, _, places, tied in self.gears:
            if tied:
                at = int(places[0]) + added
                symbol, joint, unit, _ = names[at]
                values[at] += 1.0
                names.insert(at + 2, (symbol.replace("a_m", "a_g"), joint, unit, None))
                values = np.insert(values, at + 2, 2.0 - values[at])
                deviations = np.insert(deviations, at + 2, deviations[at])
                robusts = np.insert(robusts, at + 2, robusts[at])
                added += 1
        return names, values, deviations, robusts


def fit_structured(linear: FittedModel, weights: Array) -> StructuredFit:
    """The structured estimate, started from the linear form and the load that its power sign came from.

    weights : (n,) of the joints' rows. The linear form's own do not serve: where it fits noise its residuals are
              far too small.
    """
    assert linear.load_from is not None  # the linear form always has the load of a model fitted before
    form = _Form(linear)
    theta = form.begin(linear.load_from, linear)
    observation = linear.observation
    best: tuple[float, Array, Observation, FittedTorque] | None = None
    for _ in range(POWER_SIGN_ROUNDS):
        rows = _rows(observation, weights)
        theta = _minimise(form, rows, theta)
        while form.rotors and best is None:
            fit = _with_coefficients(form, linear.fit, observation, weights, theta)
            held = form.hold(theta, _deviations(form, fit, observation, rows, theta)[1])
            if held is None:
                break
            theta = _minimise(form, rows, held)
        # what these parameters leave with the power sign of their own load, which is what anybody computes with them
        load = form.load(theta)
        observation = observe(linear.record, linear.entries, linear.slots, load)
        left = _residual(form, _rows(observation, weights), theta)
        cost = float(left @ left)
        if best is not None and cost >= best[0] * (1 - 1e-6):
            break
        best = (cost, theta, observation, load)
    assert best is not None
    _, theta, observation, load = best
    fit = replace(linear.fit, weights=weights)
    return _result(form, replace(linear, observation=observation, load_from=load, fit=fit), theta)


def held_out(linear: FittedModel, structured: StructuredFit) -> tuple[float, float]:
    """Relative errors of the linear and the structured form on time that the fit did not see.

    Four folds of consecutive blocks of time of every session; both forms with the same columns and weights.
    """
    observation = structured.fitted.observation
    form, theta = structured.form, structured.theta
    weights = structured.fitted.fit.weights
    squares = np.zeros((2, 2))
    for fold in folds(observation):
        training = [block for block in range(len(observation.blocks)) if block not in fold]
        solved = least_squares(observation, linear.fit.fitted, training, weights)
        moved = _minimise(form, _rows(observation, weights, training), theta)
        rows = _rows(observation, weights, sorted(fold))
        for index, chi in enumerate((solved.chi, form.coefficients(moved)[0])):
            residual = rows[:, -2] - rows[:, :-2] @ chi
            squares[index] += residual @ residual, rows[:, -1] @ rows[:, -1]
    errors = np.sqrt(squares[:, 0] / np.maximum(squares[:, 1], 1e-300))
    return float(errors[0]), float(errors[1])


def folds(observation: Observation, count: int = 4) -> list[set[int]]:
    """Blocks of each fold: every session cut into `count` consecutive parts."""
    blocks_of_folds: list[set[int]] = [set() for _ in range(count)]
    for session in range(len(observation.entries)):
        for fold, part in enumerate(np.array_split(observation.blocks_of(session), count)):
            blocks_of_folds[fold].update(int(block) for block in part)
    return blocks_of_folds


def _rows(observation: Observation, weights: Array, blocks: Sequence[int] | None = None) -> Array:
    """Weighted rows of all joints, [W Y tau]."""
    listed = enumerate(weights)
    return np.vstack([joint_rows(observation, joint, blocks) * weight for joint, weight in listed])


def _residual(form: "_Form", rows: Array, theta: Array) -> Array:
    """(rows,) what the parameters leave of weighted rows."""
    return rows[:, -2] - rows[:, :-2] @ form.coefficients(theta)[0]


def _minimise(form: "_Form", rows: Array, theta: Array) -> Array:
    """The parameters with the least sum of squares, by Levenberg and Marquardt's method (Marquardt 1963)."""
    W, Y = rows[:, :-2], rows[:, -2]
    damping = 1e-3
    chi, slope = form.coefficients(theta)
    residual = Y - W @ chi
    cost = float(residual @ residual)
    for _ in range(MOST_STEPS):
        J = W @ slope
        scale = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
        unit = J / scale
        step = np.linalg.solve(unit.T @ unit + damping * np.eye(len(theta)), unit.T @ residual)
        tried = theta + step / scale
        chi, tried_slope = form.coefficients(tried)
        tried_residual = Y - W @ chi
        tried_cost = float(tried_residual @ tried_residual)
        if tried_cost < cost:
            fallen = (cost - tried_cost) / cost
            theta, slope, residual, cost = tried, tried_slope, tried_residual, tried_cost
            damping = max(damping / 10, 1e-12)
            if fallen < CONVERGED:
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    return theta


def _result(form: _Form, linear: FittedModel, theta: Array) -> StructuredFit:
    observation, weights = linear.observation, linear.fit.weights
    fit = _with_coefficients(form, linear.fit, observation, weights, theta)
    std, robust = _deviations(form, fit, observation, _rows(observation, weights), theta)
    held = {form.names[place][0] for place in form.held}
    held |= {name.replace("a_m", "a_g") for name in held}  # one and the same where the joint is tied
    names, values, std, robust = form.reported(theta, std, robust)
    estimate = Estimate(fit, np.full(form.width, np.nan), np.full(form.width, np.nan), ())
    fitted = replace(linear, fit=fit, estimate=estimate, eliminated=())
    return StructuredFit(
        form,
        theta,
        fitted,
        tuple(names),
        values,
        std,
        robust,
        tuple(form.tied),
        frozenset(held),
        tuple(form.untold),
    )


def _with_coefficients(
    form: _Form, fit: LeastSquares, observation: Observation, weights: Array, theta: Array
) -> LeastSquares:
    """The linear form's fit with the coefficients that the physical parameters make."""
    chi, slope = form.coefficients(theta)
    fit = with_parameters(replace(fit, weights=weights), observation, chi)
    return replace(fit, fitted=np.flatnonzero(np.any(slope != 0, axis=1)), dropped=np.zeros(0, np.intp))


def _deviations(
    form: _Form, fit: LeastSquares, observation: Observation, rows: Array, theta: Array
) -> tuple[Array, Array]:
    """(parameters,) each: deviations of white residuals and of coloured ones; NaN where the data do not tell."""
    slope = form.coefficients(theta)[1]
    J = rows[:, :-2] @ slope
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    seen = _seen(J / scale)
    std, robust = np.full(len(theta), np.nan), np.full(len(theta), np.nan)
    freedom = max(1, int(fit.rows.sum()) - int(seen.sum()))
    variance = float(np.sum((fit.weights * fit.residual) ** 2)) / freedom
    inverse = np.linalg.pinv(J[:, seen] / scale[seen])
    std[seen] = np.sqrt(variance) * np.linalg.norm(inverse, axis=1) / scale[seen]
    slopes, scores = _block_products(observation, fit, slope[:, seen] / scale[seen])
    sessions = observation.sessions
    robust[seen] = deviation_from_blocks(slopes, scores, slopes, sessions) / scale[seen]
    return std, robust


def _block_products(observation: Observation, fit: LeastSquares, slope: Array) -> tuple[Array, Array]:
    """JᵀJ and Jᵀρ of every block, weighted: (blocks, p, p) and (blocks, p)."""
    slopes, scores = [], []
    for factors in observation.factors:
        gram, score = np.zeros((slope.shape[1],) * 2), np.zeros(slope.shape[1])
        for joint, factor in enumerate(factors):
            columns = observation.joint_columns[joint]
            J = fit.weights[joint] * (factor.r[:, :-2] @ slope[columns])
            residual = fit.weights[joint] * (factor.r[:, -2] - factor.r[:, :-2] @ fit.chi[columns])
            gram += J.T @ J
            score += J.T @ residual
        slopes.append(gram)
        scores.append(score)
    return np.array(slopes), np.array(scores)


def _seen(J: Array) -> NDArray[np.bool_]:
    """Which parameters those before them leave something to tell of."""
    seen = np.linalg.norm(J, axis=0) > 0.5  # of unit norm, or nothing at all
    basis = np.zeros((len(J), 0))
    for index in np.flatnonzero(seen):
        rest = J[:, index] - basis @ (basis.T @ J[:, index])
        rest -= basis @ (basis.T @ rest)
        left = float(np.linalg.norm(rest))
        seen[index] = left > NOT_SEEN
        if seen[index]:
            basis = np.column_stack([basis, rest / left])
    return seen
