"""How probable it is that an effect is missing: evidence on unseen motion, under a coloured noise of the joint.

Every candidate beside the model, and the model alone, is a model of the joint. Each predicts motion that its fit did not
see, fold by fold; the logarithm of its predictive density under Gaussian noise, with as many independent samples as the
residual's memory leaves, is its evidence there. A Bayesian bootstrap over the folds carries over what few folds do not
know of themselves (pseudo-BMA+; Y. Yao, A. Vehtari, D. Simpson, A. Gelman, "Using stacking to average Bayesian
predictive distributions", Bayesian Analysis 13(3), 2018, section 3.4; D. Rubin, "The Bayesian bootstrap", 1981).

What is said of a joint is one distribution: nothing is missing, this effect is, or what is missing is in no catalogue. An
effect that is there but too small to be called missing belongs to the first, so that its weight counts for the effect only
in those draws of the bootstrap in which it is worth a name; and all effects of the catalogue share what is left by the
probability that the cause is in none.

One rule joins them to names and verdict: what is said is at least as probable as not, and what is not said at most. The
density knows nothing of some of the questions that a name must pass. The evidence of question 2 bounds a probability as a
p-value bounds the odds for an effect (T. Sellke, M. Bayarri, J. Berger, "Calibration of p values for testing precise null
hypotheses", The American Statistician 55(1), 2001), even at the probability at which a name is given; an effect that a
session refutes has none; and all that fail any question share at most one half.

No catalogue is complete. Beforehand a cause of none is as probable as one candidate for each question by which it is looked
for; where none of them finds structure, what is left of it is what they miss (`STRUCTURE_RIGHT`), and no word of the catalogue is
surer than that leaves. Where one does, a name of the catalogue is one of two explanations of the same, between which nothing
decides.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.deciding_constants import SIGNIFICANCE, STRUCTURE_RIGHT
from identify.diagnosis.finding import Finding
from identify.diagnosis.held_out import HeldOut
from identify.diagnosis.structure import Structure
from identify.estimation.prediction import Prediction
from identify.results.diagnosis import Verdict

Array = NDArray[np.float64]

ALONE = 0.5
"""Prior probability that the model misses nothing on a joint; the candidates share the rest. An effect that the data and
this prior put at one half is at three quarters with 0.25, and at one quarter with 0.75."""
DRAWS = 400
"""of the bootstrap; the scatter of a probability over them is at most 0.5/√400 = 0.025"""
LONGEST_MEMORY = 0.25
"""Part of a session over which the residual's autocorrelation is summed."""
EVEN = 0.5
"""What is said is at least so probable, what is not at most."""


def independent_samples(predictions: Sequence[Prediction]) -> float:
    """How many independent samples the residuals of a joint in motion are worth.

    Samples over 1 + 2 Σ ρ_k, the sum up to where the autocorrelation ρ_k first falls below zero (Geyer 1992).
    """
    count = 0.0
    for part in predictions:
        residual = part.residual[part.moving]
        size = len(residual)
        if size < 8 or not np.any(residual):
            count += size
            continue
        centred = residual - residual.mean()
        spectrum = np.abs(np.fft.rfft(centred, 2 * size)) ** 2
        correlation = np.fft.irfft(spectrum)[: max(2, int(LONGEST_MEMORY * size))]
        correlation = correlation / max(float(correlation[0]), 1e-300)
        below = np.flatnonzero(correlation < 0)
        stop = int(below[0]) if len(below) else len(correlation)
        count += size / max(1.0, 1.0 + 2.0 * float(correlation[1:stop].sum()))
    return max(count, 1.0)


def probabilities(
    alone: HeldOut, others: Sequence[HeldOut], samples: float, least: Sequence[float] | None = None
) -> tuple[float, Array]:
    """Of the model alone, and of it with each of some candidates: (k,); they sum to one.

    alone, others : squared errors by fold without and with each candidate
    samples       : independent ones over all folds
    least         : how far each must lower the squared error to be missing; with less, the model alone does
    """
    folds, weights = _folds([alone, *others]), _bootstrapped(alone)
    prior = np.array([EVEN, *([(1 - EVEN) / max(len(others), 1)] * len(others))])
    drawn = _posterior(folds, weights, samples, prior)
    if least is not None and len(others):
        errors = weights @ folds.T
        # what must be gained is a part of the error, whichever stretches are drawn
        part = np.asarray(least) / folds[0].sum()
        drawn[:, 1:] *= errors[:, :1] - errors[:, 1:] >= part * errors[:, :1]
    missing = drawn[:, 1:].mean(axis=0)
    return float(1.0 - missing.sum()), missing


def shares(models: Sequence[HeldOut], samples: float) -> Array:
    """(k,) of some models, one of which is right and none of which is more probable beforehand."""
    folds = _folds(models)
    prior = np.full(len(models), 1.0 / len(models))
    return _posterior(folds, _bootstrapped(models[0]), samples, prior).mean(axis=0)


def _folds(models: Sequence[HeldOut]) -> Array:
    """(models, folds) squared errors."""
    return np.maximum(np.array([model.fold for model in models]), 1e-300)


def _bootstrapped(model: HeldOut) -> Array:
    """(draws, folds) how often each fold counts."""
    random = np.random.default_rng(0)  # the same record gives the same figures
    return random.dirichlet(np.ones(len(model.fold)), DRAWS) * len(model.fold)


def _posterior(folds: Array, weights: Array, samples: float, prior: Array) -> Array:
    """(draws, models) probabilities, those of a draw summing to one."""
    variance = folds.sum(axis=1) / samples
    share = folds[0] / folds[0].sum()
    evidence = -0.5 * (samples * share * np.log(variance)[:, None] + folds / variance[:, None])
    score = weights @ evidence.T + np.log(prior)
    drawn = np.exp(score - score.max(axis=1, keepdims=True))
    return np.asarray(drawn / drawn.sum(axis=1, keepdims=True))


def needed(before: HeldOut, after: HeldOut, samples: float, least: float | None = None) -> float:
    """Probability that an effect is needed beside all the others of a model."""
    return float(probabilities(before, [after], samples, None if least is None else [least])[1][0])


@dataclass(frozen=True)
class JointProbabilities:
    """What is probable of one joint.

    effects     : of each candidate, that it is missing
    adequate    : that nothing is missing which would be worth an operator's while
    unexplained : that something is left which no effect of the catalogue explains
    """

    effects: Mapping[str, float]
    adequate: float
    unexplained: float

    def beyond_the_catalogue(self, replaced: Collection[str]) -> "JointProbabilities":
        """The same where a description holds in the place of some effects: the cause is as probably in no catalogue as where
        a predictor says so, or as these were to be missing; the rest share what is left."""
        moved = max((self.effects.get(name, 0.0) for name in replaced), default=0.0)
        unexplained = max(self.unexplained, STRUCTURE_RIGHT, moved)
        left = (1.0 - unexplained) / max(1.0 - self.unexplained, 1e-300)
        effects = {name: 0.0 if name in replaced else left * each for name, each in self.effects.items()}
        return JointProbabilities(effects, left * self.adequate, unexplained)


def joint_probabilities(
    last: Sequence[Finding],
    samples: float,
    named: Mapping[str, Finding],
    rivals: Mapping[str, Sequence[str]],
    structure: Sequence[Structure],
    outcome: Verdict,
    contested: Mapping[str, Sequence[Finding]] | None = None,
    least: float = 0.0,
    harmful: Collection[str] = (),
) -> JointProbabilities:
    """The probabilities of a joint.

    last      : its candidates beside the model with all that is named
    samples   : independent ones of what that model leaves
    named     : what each effect that is named is worth beside the others
    rivals    : of each those that explain the data alike
    contested : of each it and these, as they were when it was found; a rival that was not compared then does as well as it
    least     : the gain in squared error below which nothing is worth a name, whatever effect it is
    harmful   : what raised the error on a validation session
    """
    effects: dict[str, float] = {}
    missed = _missed(len(last), len(structure))
    unexplained, sure = _unexplained(structure, outcome, missed), 1.0 - missed
    nothing = 1.0
    if last:
        bounds = [max(least, each.least_gain) for each in last]
        _, weights = probabilities(last[0].before, [_evident(each) for each in last], samples, bounds)
        weights = np.minimum(weights, [_evidence_bound(each.p_value) for each in last])
        refuted = [not each.sessions_agree or each.candidate.name in harmful for each in last]
        weights = np.where(refuted, 0.0, weights)
        weights *= min(1.0, EVEN / max(float(weights.sum()), EVEN))
        if outcome == "adequate":
            others = unexplained + (1.0 - unexplained) * float(weights.sum())
            even = EVEN / max(others, EVEN)
            weights *= even * (1.0 - unexplained) / (1.0 - even * unexplained)
            unexplained *= even
        nothing = 1.0 - float(weights.sum())
        for finding, weight in zip(last, weights, strict=True):
            effects[finding.candidate.name] = sure * (1.0 - unexplained) * float(weight)
    adequate = nothing * (1.0 - unexplained)
    for name, finding in named.items():
        bound = max(least, finding.least_gain)
        need = needed(finding.before, finding.after, samples, bound)
        most = EVEN if outcome == "unexplained" else _evidence_bound(finding.p_value)
        need = sure * max(EVEN, min(need, most))
        adequate *= 1.0 - need
        others = [other for other in rivals.get(name, ()) if other not in named]
        known = {each.candidate.name: each.after for each in (contested or {}).get(name, ())}
        with_it = known.get(name, finding.after)
        whole = shares([with_it, *(known.get(other, with_it) for other in others)], samples)
        effects[name] = need * float(whole[0])
        for other, share in zip(others, whole[1:].tolist(), strict=True):
            effects[other] = max(effects.get(other, 0.0), need * share)
    return JointProbabilities(effects, float(np.clip(adequate, 0.0, 1.0)), unexplained)


def _evidence_bound(p_value: float) -> float:
    """The most that a p-value, corrected for all that was tried, leaves for an effect; even at `SIGNIFICANCE`."""
    return _probability(_odds_against(SIGNIFICANCE) / max(_odds_against(p_value), 1e-300))


def probability_left(p_value: float) -> float:
    """The least probability that a p-value leaves for what it speaks against, were that as probable as not beforehand."""
    return _probability(_odds_against(p_value))


def _probability(odds: float) -> float:
    return odds / (1.0 + odds)


def _odds_against(p_value: float) -> float:
    """The least odds for nothing that a p-value leaves, whatever the effect's size: −e p ln p, one from 1/e on."""
    return 1.0 if p_value >= 1 / np.e else float(-np.e * p_value * np.log(max(p_value, 1e-300)))


def _evident(finding: Finding) -> HeldOut:
    """The errors with a candidate, as far as it accounts for the gain; those without it where what it explains may be the
    disturbance's (closed loop)."""
    if finding.loop is None:
        return finding.before if finding.candidate.from_derivatives else finding.after
    part = finding.loop.part if finding.justified else 0.0
    gained = finding.before.fold - finding.after.fold
    return replace(finding.after, fold=finding.before.fold - part * gained)


def _missed(candidates: int, questions: int) -> float:
    """Probability of a cause of no catalogue where none of the questions that look for one finds it; everything that can be
    missing is equally probable beforehand."""
    before = (1.0 - EVEN) * questions / max(candidates + questions, 1)
    left = before * (1.0 - STRUCTURE_RIGHT)
    return left / (1.0 - before + left)


def _unexplained(structure: Sequence[Structure], outcome: Verdict, missed: float) -> float:
    """From how near what a predictor without any model finds comes to what is called structure."""
    if outcome == "unexplained":
        return STRUCTURE_RIGHT
    nearest = max((each.share / each.least for each in structure if each.certain), default=0.0)
    return min(EVEN, float(missed + (EVEN - missed) * np.clip(nearest - 0.5, 0.0, 1.0)))
