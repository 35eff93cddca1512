"""The model as a Python module that needs NumPy alone."""

from __future__ import annotations

import numpy as np

from identify.estimation.rigid_body import POSITION_STEP
from identify.export.exported_model import ExportedModel, Torque
from identify.export.expression_code import PYTHON, one_line, torque_text

TEMPLATE = '''"""Inverse dynamics of {experiment}, model {name}: torque of each joint from its motion. Written by coulomb.

SI units, joint space: rad or m, s, kg, N m or N. Every array has the joints first: (n,) for one instant or (n, samples).
{remarks}"""

import numpy as np

JOINTS = {joints!r}
GRAVITY = {gravity}
# modified Denavit-Hartenberg frames (Khalil-Kleinfinger): alpha, d, theta, r, prismatic
FRAMES = {frames}
# XX XY XZ YY YZ ZZ MX MY MZ M Ia of each link about its own frame's origin: one choice of many with the same torques
LINKS = {links}
# motor velocities are SHARES.T @ dq
SHARES = {shares}
MEMORIES = {memories}
"""for each state of presliding, or place in a gap: joint and distance, or gap, in rad or m"""
PLAY = {play}
"""whether it is a place in a gap"""
{across}

{torque}    q, dq, ddq = (np.asarray(values, float) for values in (q, dq, ddq))
    load = rigid_torque(q, dq, ddq, payload)
    total = load.copy()
    temp = np.full(q.shape, 20.0) if temperature is None else np.asarray(temperature, float)
    direction = np.sign(dq)
    motor_dq = np.tensordot(SHARES.T, dq, 1)
    motor_ddq = np.tensordot(SHARES.T, ddq, 1)
    state = memory_at_start(dq) if memory is None else memory
{body}    return total
{cycles}

def memory_at_start(dq):
    """States of the presliding elements, and places in gaps, where nothing is known of what was before."""
    return [np.sign(dq)[joint] * (-0.5 if play else 1.0) for (joint, _), play in zip(MEMORIES, PLAY)]


def memory_after(memory, before, after):
    """The same states after a motion from positions `before` to `after` in one direction."""
    moved = []
    for state, (joint, distance), play in zip(memory, MEMORIES, PLAY):
        travel = np.asarray(after, float)[joint] - np.asarray(before, float)[joint]
        if play:
            moved.append(np.clip(state - travel / distance, -0.5, 0.5))
            continue
        heading = np.sign(travel)
        fading = np.exp(-np.abs(travel) / distance)
        moved.append(np.where(heading == 0.0, state, heading + (state - heading) * fading))
    return moved


def rigid_torque(q, dq, ddq, payload=None, gravity=GRAVITY):
    """tau_out of eq. (6): inertia, Coriolis, centrifugal and gravity torque, by the recursion of Newton and Euler."""
    links = LINKS.copy()
    if payload is not None:
        links[-1, :10] += payload
    shape = q.shape[1:]
    rate, change = np.zeros((3, *shape)), np.zeros((3, *shape))
    acceleration = np.broadcast_to(-gravity.reshape(3, *([1] * len(shape))), (3, *shape)).astype(float)
    frames, forces, moments = [], [], []
    for joint, (alpha, d, theta, r, prismatic) in enumerate(FRAMES):
        angle = theta + (0.0 if prismatic else q[joint]) + np.zeros(shape)
        along = r + (q[joint] if prismatic else 0.0) + np.zeros(shape)
        ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(angle), np.sin(angle)
        o, u = np.zeros(shape), np.ones(shape)
        turn = np.array([[ct, -st, o], [ca * st, ca * ct, -sa * u], [sa * st, sa * ct, ca * u]])
        place = np.array([d * u, -sa * along, ca * along])
        acceleration = acceleration + _cross(change, place) + _cross(rate, _cross(rate, place))
        rate, change, acceleration = (_back(turn, vector) for vector in (rate, change, acceleration))
        z = np.array([o, o, u])
        if prismatic:
            acceleration = acceleration + z * ddq[joint] + 2.0 * _cross(rate, z * dq[joint])
        else:
            change = change + z * ddq[joint] + _cross(rate, z * dq[joint])
            rate = rate + z * dq[joint]
        xx, xy, xz, yy, yz, zz, mx, my, mz, mass, _ = links[joint]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        first = np.array([mx, my, mz]).reshape(3, *([1] * len(shape)))
        spin = np.tensordot(inertia, rate, 1)
        forces.append(mass * acceleration + _cross(change, first) + _cross(rate, _cross(rate, first)))
        moments.append(np.tensordot(inertia, change, 1) + _cross(rate, spin) + _cross(first + o, acceleration))
        frames.append((turn, place))
    result = np.zeros(q.shape)
    for joint in reversed(range(len(FRAMES))):
        felt = forces[joint] if FRAMES[joint][4] else moments[joint]
        result[joint] = felt[2] + links[joint, 10] * ddq[joint]
        if joint:
            turn, place = frames[joint]
            carried = _forth(turn, forces[joint])
            forces[joint - 1] = forces[joint - 1] + carried
            moments[joint - 1] = moments[joint - 1] + _forth(turn, moments[joint]) + _cross(place, carried)
    return result


def _cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _forth(turn, vector):
    return np.einsum("ij...,j...->i...", turn, vector)


def _back(turn, vector):
    return np.einsum("ji...,j...->i...", turn, vector)
'''

TORQUE = '''{guard}def torque(q, dq, ddq, t=0.0, temperature=None, memory=None, payload=None):
    """Torque that the motors must give, as the current reference times the drive gain.

    t           : s since the machine began to move, for friction that warms up
    temperature : °C of each joint, for friction that depends on it
    memory      : state of each presliding element, -1 to 1; begin with `memory_at_start(dq)`
    payload     : XX XY XZ YY YZ ZZ MX MY MZ M of a body on the last link, in its frame
    """
'''

ALONG = '''LATENCY = {latency}
"""samples that must follow one whose torque is known, for differences over time"""


{guard}def torque_along(q, dq, ddq, time, t=0.0, temperature=None, memory=None, payload=None):
    """Torque (n, samples) that the motors must give along a motion, as the current reference times the drive gain.

    q, dq, ddq  : (n, samples)
    time        : (samples,) s of the samples, for derivatives over time: differences between neighbours, one-sided at the ends
    t           : s since the machine began to move, for friction that warms up
    temperature : °C of each joint, for friction that depends on it
    memory      : states, each (samples,) or one value; of the first sample `memory_at_start`, of each next one `memory_after`
    payload     : XX XY XZ YY YZ ZZ MX MY MZ M of a body on the last link, in its frame
    """
'''

CYCLES = '''

class Cycles:
    """The torque cycle by cycle: that of the motion that was given LATENCY cycles before, whose neighbours are then known.

    Give the planned motion LATENCY cycles ahead. In the first LATENCY cycles it is the first motion's torque without what is
    differentiated over time.
    """

    def __init__(self):
        self.begin()

    def begin(self):
        """Forget all motion: the next one is the first."""
        self._given = []

    def torque(self, q, dq, ddq, period, t=0.0, temperature=None, payload=None):
        """Torque (n,) of the motion LATENCY cycles before.

        q, dq, ddq  : (n,), of a time one `period` (s) after those of the call before
        temperature : °C of each joint; all others as in `torque_along`
        """
        q, dq, ddq = (np.array(values, float) for values in (q, dq, ddq))
        warm = np.full(q.shape, 20.0) if temperature is None else np.array(temperature, float)
        if self._given:
            before, _, _, _, clock, _, memory = self._given[-1]
            memory, clock = memory_after(memory, before, q), clock + period
        else:
            memory, clock = memory_at_start(dq), 0.0
        self._given = [*self._given[-2 * LATENCY :], (q, dq, ddq, warm, clock, t, memory)]
        shown = self._given if len(self._given) > LATENCY else self._given[:1]
        q, dq, ddq, warm = (np.array([given[place] for given in shown]).T for place in range(4))
        time, t = (np.array([given[place] for given in shown]) for place in (4, 5))
        memory = [np.array(state) for state in zip(*(given[6] for given in shown))]
        wanted = len(self._given) - 1 - LATENCY if len(shown) > 1 else 0
        return torque_along(q, dq, ddq, time, t, warm, memory, payload)[:, wanted]


def _rate(values, time):
    """Derivative over time: of neighbours on both sides, at the ends of one."""
    return np.gradient(values, time) if len(time) > 1 else np.zeros(1)
'''

SLOPE = '''

def _load_slope(joint, q, dq, ddq, payload):
    """Derivative of a joint's load over its own position."""
    moved = np.zeros(q.shape)
    moved[joint] = {step}
    further, less = (rigid_torque(at, dq, ddq, payload)[joint] for at in (q + moved, q - moved))
    return (further - less) / {twice}
'''

ACROSS = '''ACROSS = {}
"""m/s² each: two directions across gravity, for a base that is not level"""
'''

FINITE = """

def _finite(values):
    return np.where(np.isfinite(values), values, 0.0)
"""


def python_code(model: ExportedModel) -> str:
    """The text of the module."""
    geometry = model.geometry
    frames = [
        (
            *(float(torque[joint]) for torque in (geometry.alpha, geometry.d, geometry.theta, geometry.r)),
            bool(geometry.prismatic[joint]),
        )
        for joint in range(model.joints)
    ]
    first, late = model.in_order
    lines = []
    if model.across:
        lines.append(
            "    across_1, across_2 = (rigid_torque(q, 0.0 * dq, 0.0 * ddq, payload, gravity) for gravity in ACROSS)"
        )
    if model.slopes:
        listed = ", ".join(f"{joint}: _load_slope({joint}, q, dq, ddq, payload)" for joint in model.slopes)
        lines.append(f"    slope = {{{listed}}}")
    lines += [_line(model, torque) for torque in first]
    if late:
        lines.append("    whole = total.copy()")
        lines += [_line(model, torque) for torque in late]
    return TEMPLATE.format(
        experiment=_quoted(model.experiment),
        name=_quoted(model.name),
        remarks="".join(f"\nRemark: {_quoted(remark)}.\n" for remark in model.remarks),
        joints=list(geometry.names),
        gravity=_array(geometry.gravity),
        frames=frames,
        links=_array(model.standard.reshape(model.joints, -1)),
        shares=_array(model.shares),
        memories=[(memory.row, memory.distance) for memory in model.memories],
        play=[memory.kind == "play" for memory in model.memories],
        across=ACROSS.format(_array(np.array(model.across))) if model.across else "",
        torque=(ALONG if model.latency else TORQUE).format(
            guard='@np.errstate(all="ignore")\n' if model.may_have_no_value else "", latency=model.latency
        ),
        cycles=(CYCLES if model.latency else "")
        + (SLOPE.format(step=repr(POSITION_STEP), twice=repr(2 * POSITION_STEP)) if model.slopes else ""),
        body="".join(f"{line}\n" for line in lines),
    ) + (FINITE if model.may_have_no_value else "")


def _line(model: ExportedModel, torque: Torque) -> str:
    text = torque_text(model, torque, PYTHON)
    for _ in range(torque.derivative):
        text = f"_rate({text}, time)"
    return f"    total[{torque.row}] += {text}  # {torque.effect}"


def _quoted(text: str) -> str:
    """Text inside a docstring of one line: it can neither end the docstring nor be read as an escape."""
    return one_line(text).replace("\\", "\\\\").replace('"', '\\"')


def _array(values) -> str:
    return f"np.array({values.tolist()!r})"
