"""A model is the rigid robot and a list of effects, each of one joint."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from identify.effects.effect import Effect
from identify.effects.motion import Array
from identify.recording.errors import InputError

USUAL = ("viscous", "coulomb", "offset")
"""eq. (8)"""

NAMED_MODELS: dict[str, tuple[str, ...]] = {
    "rigid": ("offset",),
    "usual": USUAL,
    "load-velocity": (*USUAL, "coupled-friction", "load-friction-asymmetric", "stribeck", "load-stribeck"),
    "link-side": ("offset",),
}
LINK_SIDE = "link-side"
"""The torque is measured behind the gear, by a sensor on the link's side: neither the rotor's inertia nor the friction of motor
and gear is in it. What is left is the rigid links and the sensor's offset."""
IN_EVERY_MODEL = NAMED_MODELS["rigid"]
"""effects that no model is without"""


@dataclass(frozen=True)
class Term:
    """An effect of one joint, the nonlinear constants chosen or (None) still to be searched."""

    effect: Effect
    joint: int
    constants: tuple[tuple[str, float], ...] | None = None

    @property
    def key(self) -> tuple[str, int]:
        """What makes two terms the same: effect and joint."""
        return (self.effect.name, self.joint)

    def chosen(self, constants: dict[str, float]) -> "Term":
        """The same term with these constants."""
        return replace(self, constants=tuple(sorted(constants.items())))


@dataclass(frozen=True)
class Model:
    """The rigid robot and its effects.

    name : as the user wrote it
    terms : effects by joint, without repetition, in the order of the joints and of adding
    """

    name: str
    terms: tuple[Term, ...]

    def with_terms(self, terms: Iterable[Term]) -> "Model":
        """This model and further terms; a term that it already has is not added twice."""
        present = {term.key for term in self.terms}
        added = []
        for term in terms:
            if term.key not in present:
                present.add(term.key)
                added.append(term)
        return replace(self, terms=(*self.terms, *added))

    def without(self, key: tuple[str, int]) -> "Model":
        """This model less one term."""
        return replace(self, terms=tuple(term for term in self.terms if term.key != key))

    def with_constants(self, terms: Sequence[Term]) -> "Model":
        """The same terms with their constants chosen."""
        return replace(self, terms=tuple(terms))

    def has(self, name: str, joint: int) -> bool:
        """Whether the effect acts on the joint in this model."""
        return (name, joint) in {term.key for term in self.terms}


def motor_shares(drive_gain: Array) -> Array:
    """c[j, m]: torque on joint j per unit of torque that motor m gives its own joint, (n, n).

    The columns of the drive gain matrix (eq. 4) in units of their diagonal; the velocity of motor m, in units
    of its own joint, is c[:, m] · dq (the transpose: no power is lost in a coupling).
    """
    diagonal = np.diag(drive_gain)
    return drive_gain / np.where(diagonal == 0, 1.0, diagonal)


def load_shares(drive_gain: Array) -> Array:
    """c⁻¹[m, j]: what of the load of joint j the gear of motor m carries, (n, n).

    Power balance asks for it: the loads of the joints times their velocities are those of the motors times theirs.
    """
    shares = motor_shares(drive_gain)
    try:
        return np.asarray(np.linalg.inv(shares), np.float64)
    except np.linalg.LinAlgError:  # motors that cannot be told apart share the load alike
        return np.asarray(np.linalg.pinv(shares), np.float64)


def gear_apart(drive_gain: Array, motor: int) -> bool:
    """Whether the gear of a motor turns, or carries, other than its own joint does: friction is then the motor's."""
    joint = np.eye(len(drive_gain))[motor]
    turns, carries = motor_shares(drive_gain)[:, motor], load_shares(drive_gain)[motor]
    return not (np.array_equal(turns, joint) and np.array_equal(carries, joint))


def model_name(text: str) -> str:
    """A model as documents name it: without spaces, and each effect of a list once, in the order in which they were named.

    What is no model stays as it is, for `parse_model` to refuse.
    """
    base, plus, listed = text.strip().partition("+")
    names = dict.fromkeys(name.strip() for name in listed.split(",") if name.strip())
    return f"{base.strip()}{plus}{','.join(names)}"


def parse_model(
    text: str, joint_names: Sequence[str], known: Mapping[str, Effect], drive_gain: Array
) -> Model:
    """The model that the user named: `rigid`, `usual`, `load-velocity`, `link-side`, or `rigid+effect,effect…`.

    Raises InputError: a name that is no model and no effect.
    """
    base, plus, listed = model_name(text).partition("+")
    if plus and base != "rigid":
        raise InputError(f"model '{text}': a list of effects follows 'rigid+', e.g. 'rigid+viscous,coulomb'")
    if base not in NAMED_MODELS:
        raise InputError(
            f"model '{text}': not a model; models are {', '.join(NAMED_MODELS)}, or 'rigid+' and a list of effects"
            + (f"; did you mean '{near[0]}'?" if (near := get_close_matches(base, NAMED_MODELS, 1)) else "")
        )
    names = list(NAMED_MODELS[base])
    if plus:
        names += listed.split(",")
        if not listed:
            raise InputError(f"model '{text}': after 'rigid+' a comma-separated list of effects is missing")
    model = Model(model_name(text), ())
    for name in names:
        model = model.with_terms(parse_addition(name, joint_names, known, drive_gain, f"model '{text}'"))
    return model


def parse_addition(
    text: str,
    joint_names: Sequence[str],
    known: Mapping[str, Effect],
    drive_gain: Array,
    where: str = "",
) -> list[Term]:
    """Terms of `EFFECT` (every joint) or `EFFECT@JOINT`.

    An effect of a shared motor belongs to the motor's own joint; one of the whole robot stands once.

    Raises InputError: an effect or joint of that name does not exist.
    """
    name, at, joint_name = text.partition("@")
    where = where or f"--add {text}"
    if name not in known:
        raise InputError(f"{where}: there is no effect '{name}'; {_meant(name, known)}")
    if at and joint_name not in joint_names:
        raise InputError(f"{where}: there is no joint '{joint_name}'; joints are {', '.join(joint_names)}")
    joints = [list(joint_names).index(joint_name)] if at else list(range(len(joint_names)))
    return terms_of(known[name], joints, drive_gain)


def _meant(name: str, known: Iterable[str]) -> str:
    """The known name nearest to a wrong one, as a question; all known names where none is near."""
    names = list(known)
    near = get_close_matches(name, names, 1)
    return f"did you mean '{near[0]}'?" if near else f"effects are {', '.join(names)}"


def terms_of(effect: Effect, joints: Iterable[int], drive_gain: Array) -> list[Term]:
    """The terms that an effect makes on these joints, each once."""
    if effect.rows == "robot":
        return [Term(effect, 0)]
    if effect.rows == "pair":
        return [Term(effect, joint) for joint in joints if joint > 0]
    if effect.rows in ("joint", "gear"):
        return [Term(effect, joint) for joint in joints]
    owners: list[int] = []
    for joint in joints:
        owners += [motor for motor in coupled_motors(drive_gain, joint) if motor not in owners]
    return [Term(effect, owner) for owner in owners]


def coupled_motors(drive_gain: Array, joint: int) -> list[int]:
    """Motors that act on this joint and on another one as well."""
    acting = np.abs(drive_gain) > 0
    return [int(motor) for motor in np.flatnonzero(acting[joint]) if acting[:, motor].sum() > 1]
