"""An offset that is another one in every session."""

import numpy as np

from identify.effects.conditions import SEVERAL_SESSIONS
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import PictureVariable


class SessionOffset(Effect):
    """A constant in each session but the first; in that the model's own offset has it."""

    name = "session-offset"
    title = "an offset that differs between the sessions"
    group = "actuation"
    equation = "offset_s in session s, beside the offset of all"
    explanation = (
        "The torque is off by a constant that differs between the sessions: the current sensor's zero was set or drifted "
        "between them, or something constant pulled in one of them (a cable, a balancing spring, air pressure). Check: the "
        "current at rest with the drive enabled before each session; what was attached between sessions."
    )
    regressors = ("1 in each later session",)
    parameters = (EffectParameter("offset_change", "N m"),)
    source = "paper, eq. (5), its offset one for each session"
    conditions = (SEVERAL_SESSIONS,)
    variable = "time"
    picture = PictureVariable("time", "time", "time")
    confusable = ("drive-gain", "offset")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [{f"session_{session}": float(slot) for slot, session in enumerate(summary.sessions[1:])}]

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        unit = self.parameters[0].unit
        return tuple(
            EffectParameter(f"offset_change[{name.removeprefix('session_')}]", unit) for name in constants
        )

    def of_sessions(self, constants: Constants) -> bool:
        return True

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        out = np.zeros((len(motion.q), len(constants)))
        slot = constants.get(f"session_{motion.session}")
        if slot is not None:
            out[:, round(slot)] = 1.0
        return out
