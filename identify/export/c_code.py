"""The model in C99: a header and a source without further libraries than the mathematical one."""

from __future__ import annotations

import re
from collections.abc import Mapping

from identify.export.c_cycles import across_in_c, cycles_in_c
from identify.export.exported_model import ExportedModel, Torque
from identify.export.expression_code import C, literal, one_line, torque_text

HEADER = """/* Inverse dynamics of {experiment}, model {name}: torque of each joint from its motion. Written by coulomb.
 * SI units, joint space: rad or m, s, kg, N m or N. Joints in their order from the base: {joints}.{remarks} */
#ifndef {guard}
#define {guard}
{includes}
#define {PREFIX}_JOINTS {n}
#define {PREFIX}_MEMORIES {memories} /* states of presliding, and places in gaps */

#ifdef __cplusplus
extern "C" {{
#endif

{calls}
/* tau_out of eq. (6) alone: inertia, Coriolis, centrifugal and gravity torque. */
void {prefix}_rigid_torque(const double q[{n}], const double dq[{n}], const double ddq[{n}], const double *payload,
                           double torque[{n}]);

#ifdef __cplusplus
}}
#endif
#endif
"""

SOURCE = """#include "{header}"

#include <math.h>
#include <stddef.h>

#define N {n}

/* modified Denavit-Hartenberg frames (Khalil-Kleinfinger): alpha, d, theta, r, prismatic */
static const double FRAMES[N][5] = {{
{frames}
}};
static const double GRAVITY[3] = {{{gravity}}};
{across}/* XX XY XZ YY YZ ZZ MX MY MZ M Ia of each link about its own frame's origin: one choice of many with the same torques */
static const double LINKS[N][11] = {{
{links}
}};
/* motor velocities are the transpose of SHARES times joint velocities */
static const double SHARES[N][N] = {{
{shares}
}};
{memory_table}
static double sign_of(double x) {{ return (x > 0.0) - (x < 0.0); }}
{finite}
static void cross(const double a[3], const double b[3], double out[3]) {{
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}}

static void forth(double turn[3][3], const double v[3], double out[3]) {{
    double w[3];
    for (int i = 0; i < 3; i++) w[i] = turn[i][0] * v[0] + turn[i][1] * v[1] + turn[i][2] * v[2];
    for (int i = 0; i < 3; i++) out[i] = w[i];
}}

static void back(double turn[3][3], const double v[3], double out[3]) {{
    double w[3];
    for (int i = 0; i < 3; i++) w[i] = turn[0][i] * v[0] + turn[1][i] * v[1] + turn[2][i] * v[2];
    for (int i = 0; i < 3; i++) out[i] = w[i];
}}

/* tau_out of eq. (6) under any gravity, by the recursion of Newton and Euler. */
static void torque_under(const double gravity[3], const double q[N], const double dq[N], const double ddq[N],
                         const double *payload, double torque[N]) {{
    double rate[3] = {{0.0, 0.0, 0.0}}, change[3] = {{0.0, 0.0, 0.0}};
    double acceleration[3] = {{-gravity[0], -gravity[1], -gravity[2]}};
    double turn[N][3][3], place[N][3], force[N][3], moment[N][3];
    for (int j = 0; j < N; j++) {{
        const int prismatic = FRAMES[j][4] != 0.0;
        const double angle = FRAMES[j][2] + (prismatic ? 0.0 : q[j]), along = FRAMES[j][3] + (prismatic ? q[j] : 0.0);
        const double ca = cos(FRAMES[j][0]), sa = sin(FRAMES[j][0]), ct = cos(angle), st = sin(angle);
        const double rows[3][3] = {{{{ct, -st, 0.0}}, {{ca * st, ca * ct, -sa}}, {{sa * st, sa * ct, ca}}}};
        double a[3], b[3], link[11];
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) turn[j][i][k] = rows[i][k];
        place[j][0] = FRAMES[j][1];
        place[j][1] = -sa * along;
        place[j][2] = ca * along;
        cross(change, place[j], a);
        cross(rate, place[j], b);
        cross(rate, b, b);
        for (int i = 0; i < 3; i++) acceleration[i] += a[i] + b[i];
        back(turn[j], rate, rate);
        back(turn[j], change, change);
        back(turn[j], acceleration, acceleration);
        const double moved[3] = {{0.0, 0.0, dq[j]}};
        cross(rate, moved, a);
        if (prismatic) {{
            acceleration[2] += ddq[j];
            for (int i = 0; i < 3; i++) acceleration[i] += 2.0 * a[i];
        }} else {{
            for (int i = 0; i < 3; i++) change[i] += a[i];
            change[2] += ddq[j];
            rate[2] += dq[j];
        }}
        for (int i = 0; i < 11; i++) link[i] = LINKS[j][i] + (payload != NULL && j == N - 1 && i < 10 ? payload[i] : 0.0);
        const double first[3] = {{link[6], link[7], link[8]}};
        double inertia[3][3] = {{
            {{link[0], link[1], link[2]}}, {{link[1], link[3], link[4]}}, {{link[2], link[4], link[5]}}}};
        double spin[3], c[3];
        cross(change, first, a);
        cross(rate, first, b);
        cross(rate, b, b);
        for (int i = 0; i < 3; i++) force[j][i] = link[9] * acceleration[i] + a[i] + b[i];
        forth(inertia, change, a);
        forth(inertia, rate, spin);
        cross(rate, spin, b);
        cross(first, acceleration, c);
        for (int i = 0; i < 3; i++) moment[j][i] = a[i] + b[i] + c[i];
    }}
    for (int j = N - 1; j >= 0; j--) {{
        torque[j] = (FRAMES[j][4] != 0.0 ? force[j][2] : moment[j][2]) + LINKS[j][10] * ddq[j];
        double carried[3], a[3], b[3];
        forth(turn[j], force[j], carried);
        forth(turn[j], moment[j], a);
        cross(place[j], carried, b);
        for (int i = 0; j > 0 && i < 3; i++) {{
            force[j - 1][i] += carried[i];
            moment[j - 1][i] += a[i] + b[i];
        }}
    }}
}}

void {prefix}_rigid_torque(const double q[N], const double dq[N], const double ddq[N], const double *payload,
                           double torque[N]) {{
    torque_under(GRAVITY, q, dq, ddq, payload, torque);
}}

{linkage}void {prefix}_memory_at_start(const double dq[N], double *memory) {{
{at_start}}}

{linkage}void {prefix}_memory_after(double *memory, const double before[N], const double after[N]) {{
{after}}}

{calls}"""

DECLARED = """#define {PREFIX}_LATENCY 0 /* the torque is that of the motion of its call */

/* Torque that the motors must give, as the current reference times the drive gain.
 * t           s since the machine began to move, for friction that warms up
 * temperature deg C of each joint, for friction that depends on it; NULL is 20
 * memory      state of each presliding element, -1 to 1, see below; NULL begins from the direction of motion
 * payload     XX XY XZ YY YZ ZZ MX MY MZ M of a body on the last link, in its frame; NULL is none
 * torque      the result */
void {prefix}_torque(const double q[{n}], const double dq[{n}], const double ddq[{n}], double t,
                     const double *temperature, const double *memory, const double *payload, double torque[{n}]);

/* States of the presliding elements where nothing is known of what was before. */
void {prefix}_memory_at_start(const double dq[{n}], double *memory);

/* States of the presliding elements after a motion from `before` to `after` in one direction. */
void {prefix}_memory_after(double *memory, const double before[{n}], const double after[{n}]);
"""

CALLED = """void {prefix}_torque(const double q[N], const double dq[N], const double ddq[N], double t, const double *temperature,
                     const double *memory, const double *payload, double torque[N]) {{
    double load[N], temp[N], direction[N], motor_dq[N], motor_ddq[N], begun[{states}];
    const double *state = memory;
    {prefix}_rigid_torque(q, dq, ddq, payload, load);
{across}    if (memory == NULL) {{
        {prefix}_memory_at_start(dq, begun);
        state = begun;
    }}
    for (int j = 0; j < N; j++) {{
        torque[j] = load[j];
        temp[j] = temperature == NULL ? 20.0 : temperature[j];
        direction[j] = sign_of(dq[j]);
        motor_dq[j] = 0.0;
        motor_ddq[j] = 0.0;
        for (int k = 0; k < N; k++) {{
            motor_dq[j] += SHARES[k][j] * dq[k];
            motor_ddq[j] += SHARES[k][j] * ddq[k];
        }}
    }}
    (void)t, (void)state, (void)temp, (void)direction, (void)motor_dq, (void)motor_ddq;
{body}}}
"""


def c_name(text: str) -> str:
    """A name that C allows, made of any text."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower()
    return name if name and not name[0].isdigit() else f"model_{name}".rstrip("_")


def c_code(model: ExportedModel, stem: str) -> tuple[str, str]:
    """The texts of source and header; `stem` is their file name without ending, and the prefix of their functions."""
    prefix, geometry = c_name(stem), model.geometry
    frames = [
        [
            float(torque[joint])
            for torque in (geometry.alpha, geometry.d, geometry.theta, geometry.r, geometry.prismatic)
        ]
        for joint in range(model.joints)
    ]
    states = model.memories
    table = ""
    start = "    (void)dq, (void)memory;\n"
    after = "    (void)memory, (void)before, (void)after;\n"
    if states:
        rows = ", ".join(literal(memory.distance) for memory in states)
        places = ", ".join(str(memory.row) for memory in states)
        gaps = ", ".join(str(int(memory.kind == "play")) for memory in states)
        table = (
            f"static const double DISTANCES[{len(states)}] = {{{rows}}}; /* of presliding, and gaps */\n"
            f"static const int PLACES[{len(states)}] = {{{places}}}; /* joints that they act on */\n"
            f"static const int PLAY[{len(states)}] = {{{gaps}}}; /* whether it is a gap */\n"
        )
        start = f"    for (int i = 0; i < {len(states)}; i++) memory[i] = (PLAY[i] ? -0.5 : 1.0) * sign_of(dq[PLACES[i]]);\n"
        after = (
            f"    for (int i = 0; i < {len(states)}; i++) {{\n"
            "        const double travel = after[PLACES[i]] - before[PLACES[i]], heading = sign_of(travel);\n"
            "        if (PLAY[i]) memory[i] = fmin(fmax(memory[i] - travel / DISTANCES[i], -0.5), 0.5);\n"
            "        else if (travel != 0.0) memory[i] = heading + (memory[i] - heading) * exp(-fabs(travel) / DISTANCES[i]);\n"
            "    }\n"
        )
    shared = {
        "experiment": _comment(model.experiment),
        "name": _comment(model.name),
        "remarks": "".join(f"\n * Remark: {_comment(remark)}." for remark in model.remarks),
        "joints": _comment(", ".join(geometry.names)),
        "guard": f"{prefix.upper()}_H",
        "PREFIX": prefix.upper(),
        "prefix": prefix,
        "n": model.joints,
        "memories": len(states),
    }
    declared, called = cycles_in_c(model, prefix) if model.latency else _at_once(model, shared)
    source = SOURCE.format(
        **shared,
        header=f"{stem}.h",
        linkage="static " if model.latency else "",
        calls=called,
        frames=_rows(frames),
        across=_across(model),
        gravity=", ".join(literal(float(value)) for value in geometry.gravity),
        links=_rows(model.standard.reshape(model.joints, -1).tolist()),
        shares=_rows(model.shares.tolist()),
        memory_table=table,
        finite="static double finite_of(double x) { return isfinite(x) ? x : 0.0; }\n"
        if model.may_have_no_value
        else "",
        at_start=start,
        after=after,
    )
    includes = "\n#include <stddef.h>\n" if model.latency else ""
    return source, HEADER.format(**shared, calls=declared, includes=includes)


def _at_once(model: ExportedModel, shared: Mapping[str, object]) -> tuple[str, str]:
    """The declarations and the source of a model whose torque follows from the motion of its call."""
    first, late = model.in_order
    lines = [_line(model, torque) for torque in first]
    if late:
        lines += [
            "    double whole[N];",
            "    for (int j = 0; j < N; j++) whole[j] = torque[j];",
            *(_line(model, torque) for torque in late),
        ]
    body = "".join(f"{line}\n" for line in lines)
    return DECLARED.format(**shared), CALLED.format(
        **shared, states=max(1, len(model.memories)), across=across_in_c(model), body=body
    )


def _line(model: ExportedModel, torque: Torque) -> str:
    return f"    torque[{torque.row}] += {torque_text(model, torque, C)}; /* {torque.effect} */"


def _across(model: ExportedModel) -> str:
    """The directions across gravity, where a formula asks for its torque along them."""
    if not model.across:
        return ""
    rows = _rows([direction.tolist() for direction in model.across])
    remark = "/* m/s^2 each: two directions across gravity, for a base that is not level */"
    return f"{remark}\nstatic const double ACROSS[2][3] = {{\n{rows}\n}};\n"


def _rows(table: list[list[float]]) -> str:
    return ",\n".join("    {" + ", ".join(literal(float(value)) for value in row) + "}" for row in table)


def _comment(text: str) -> str:
    """Text that can neither end a comment nor seem to begin one, which compilers warn of."""
    return one_line(text).replace("*/", "* /").replace("/*", "/ *")
