"""The part of an exported C source that is called once a cycle: for models with derivatives over time, whose torque is known
when the samples after it are."""

from __future__ import annotations

from identify.estimation.rigid_body import POSITION_STEP
from identify.export.exported_model import ExportedModel, Torque
from identify.export.expression_code import C, literal, torque_text

DECLARED = """#define {PREFIX}_LATENCY {latency} /* cycles by which a torque stands behind the motion of its call */

/* What is kept from cycle to cycle; not to be written from outside. */
typedef struct {{
    double clock, t, q[{n}], dq[{n}], ddq[{n}], load[{n}], temp[{n}], direction[{n}], motor_dq[{n}], motor_ddq[{n}];
    double state[{states}], sum[{n}], early[{early}];
}} {prefix}_instant;
typedef struct {{
    {prefix}_instant given[{width}];
    double clock[{late_width}], settled[{late_width}][{n}], late[{late_width}][{late}];
    int begun;
}} {prefix}_cycles;

/* Begin anew: the motion of the next call is the first. To be called before the first step. */
void {prefix}_begin({prefix}_cycles *cycles);

/* Bytes of what is kept, for a caller in another language. */
size_t {prefix}_size(void);

/* Torque that the motors must give, as the current reference times the drive gain, for the motion that was given
 * {PREFIX}_LATENCY steps before: derivatives over time are differences between a motion's neighbours. Give the planned
 * motion so many cycles ahead. In the first {PREFIX}_LATENCY steps it is the first motion's torque without what is
 * differentiated over time.
 * period      s since the step before; it may change from step to step
 * t           s since the machine began to move, for friction that warms up
 * temperature deg C of each joint, for friction that depends on it; NULL is 20
 * payload     XX XY XZ YY YZ ZZ MX MY MZ M of a body on the last link, in its frame; NULL is none
 * torque      the result */
void {prefix}_step({prefix}_cycles *cycles, const double q[{n}], const double dq[{n}], const double ddq[{n}], double period,
                   double t, const double *temperature, const double *payload, double torque[{n}]);
"""

SLOPE = """
/* Derivative of a joint's load over its own position. */
static double load_slope(int joint, const double q[N], const double dq[N], const double ddq[N], const double *payload) {{
    double moved[N], further[N], less[N];
    for (int j = 0; j < N; j++) moved[j] = q[j];
    moved[joint] = q[joint] + {step};
    {prefix}_rigid_torque(moved, dq, ddq, payload, further);
    moved[joint] = q[joint] - {step};
    {prefix}_rigid_torque(moved, dq, ddq, payload, less);
    return (further[joint] - less[joint]) / {twice};
}}
"""

SIGNALS = """    const double *q = now->q, *dq = now->dq, *ddq = now->ddq, *load = now->load, *temp = now->temp;
    const double *direction = now->direction, *motor_dq = now->motor_dq, *motor_ddq = now->motor_ddq, *state = now->state;
    const double t = now->t;
    (void)q, (void)dq, (void)ddq, (void)load, (void)temp, (void)direction, (void)motor_dq, (void)motor_ddq, (void)state;
    (void)t, (void)whole;
"""

EARLY_RATE = """
/* What is differentiated, at the middle one of the motions that are kept. */
static double early_rate(const {prefix}_cycles *cycles, int which, int times) {{
    double clock[{width}], value[{width}];
    for (int i = 0; i < {width}; i++) {{
        clock[i] = cycles->given[i].clock;
        value[i] = cycles->given[i].early[which];
    }}
    const double rates[3] = {{rate(clock, value), rate(clock + 1, value + 1), rate(clock + 2, value + 2)}};
    return times == 1 ? rates[1] : rate(clock + 1, rates);
}}
"""

SOURCE = """
/* Derivative over time at the middle one of three instants; of neighbours on both sides, or where one is no other, of one. */
static double rate(const double clock[3], const double value[3]) {{
    const double a = clock[1] - clock[0], b = clock[2] - clock[1];
    if (a > 0.0 && b > 0.0)
        return (value[2] - value[1]) * a / (b * (a + b)) + (value[1] - value[0]) * b / (a * (a + b));
    if (b > 0.0) return (value[2] - value[1]) / b;
    return a > 0.0 ? (value[1] - value[0]) / a : 0.0;
}}
{slope}{early_rate}
/* What follows from the motion of one instant. */
static void early_torques({prefix}_instant *now, const double *payload) {{
    double *torque = now->sum, *whole = NULL;
    double slope[N];
{signals}    (void)payload, (void)slope;
{across}    for (int j = 0; j < N; j++) torque[j] = load[j];
{early_lines}}}

/* What is made of the whole torque at one instant. */
static void late_torques(const {prefix}_instant *now, const double whole[N], double torque[N], double late[{late}]) {{
{signals}    for (int j = 0; j < N; j++) torque[j] = whole[j];
    late[0] = 0.0;
{late_lines}}}

size_t {prefix}_size(void) {{ return sizeof({prefix}_cycles); }}

void {prefix}_begin({prefix}_cycles *cycles) {{ cycles->begun = 0; }}

void {prefix}_step({prefix}_cycles *cycles, const double q[N], const double dq[N], const double ddq[N], double period,
                   double t, const double *temperature, const double *payload, double torque[N]) {{
    {prefix}_instant now, *given = cycles->given;
    const {prefix}_instant *before = &given[{width} - 1], *middle = &given[{width} / 2];
    double whole[N], settled[N], late[{late}];
    now.clock = cycles->begun ? before->clock + period : 0.0;
    now.t = t;
    if (cycles->begun) {{
        for (int i = 0; i < {states}; i++) now.state[i] = before->state[i];
        {prefix}_memory_after(now.state, before->q, q);
    }} else {{
        for (int i = 0; i < {states}; i++) now.state[i] = 0.0;
        {prefix}_memory_at_start(dq, now.state);
    }}
    {prefix}_rigid_torque(q, dq, ddq, payload, now.load);
    for (int j = 0; j < N; j++) {{
        now.q[j] = q[j];
        now.dq[j] = dq[j];
        now.ddq[j] = ddq[j];
        now.temp[j] = temperature == NULL ? 20.0 : temperature[j];
        now.direction[j] = sign_of(dq[j]);
        now.motor_dq[j] = 0.0;
        now.motor_ddq[j] = 0.0;
        for (int k = 0; k < N; k++) {{
            now.motor_dq[j] += SHARES[k][j] * dq[k];
            now.motor_ddq[j] += SHARES[k][j] * ddq[k];
        }}
    }}
    for (int i = 0; i < {early}; i++) now.early[i] = 0.0;
    early_torques(&now, payload);
    for (int i = 0; i + 1 < {width}; i++) given[i] = cycles->begun ? given[i + 1] : now;
    given[{width} - 1] = now;
    for (int j = 0; j < N; j++) whole[j] = middle->sum[j];
{early_rates}    late_torques(middle, whole, settled, late);
    for (int i = 0; i < {late_width}; i++) {{
        const int kept = cycles->begun && i + 1 < {late_width};
        cycles->clock[i] = kept ? cycles->clock[i + 1] : middle->clock;
        for (int j = 0; j < N; j++) cycles->settled[i][j] = kept ? cycles->settled[i + 1][j] : settled[j];
        for (int j = 0; j < {late}; j++) cycles->late[i][j] = kept ? cycles->late[i + 1][j] : late[j];
    }}
    cycles->begun = 1;
    for (int j = 0; j < N; j++) torque[j] = cycles->settled[{late_width} / 2][j];
{late_rates}}}
"""


def cycles_in_c(model: ExportedModel, prefix: str) -> tuple[str, str]:
    """The declarations and the source of a model with derivatives over time."""
    first, last = model.in_order
    early, late = ([each for each in part if each.derivative] for part in (first, last))
    wait, wait_for_late = model.lags
    named = {
        "prefix": prefix,
        "PREFIX": prefix.upper(),
        "n": model.joints,
        "latency": model.latency,
        "states": max(1, len(model.memories)),
        "early": max(1, len(early)),
        "late": max(1, len(late)),
        "width": 2 * wait + 1,
        "late_width": 2 * wait_for_late + 1,
    }
    slope = {"step": literal(POSITION_STEP), "twice": literal(2 * POSITION_STEP)}
    early_lines = [
        *(f"    slope[{joint}] = load_slope({joint}, q, dq, ddq, payload);" for joint in model.slopes),
        *(
            _line(model, each, f"now->early[{early.index(each)}]" if each in early else None)
            for each in first
        ),
    ]
    late_lines = [_line(model, each, f"late[{late.index(each)}]" if each in late else None) for each in last]
    source = SOURCE.format(
        **named,
        slope=SLOPE.format(**named, **slope) if model.slopes else "",
        early_rate=EARLY_RATE.format(**named) if early else "",
        signals=SIGNALS,
        across=across_in_c(model),
        early_lines=_text(early_lines),
        late_lines=_text(late_lines),
        early_rates=_text(
            f"    whole[{each.row}] += early_rate(cycles, {place}, {each.derivative}); /* {each.effect} */"
            for place, each in enumerate(early)
        ),
        late_rates=_text(
            f"    {{\n        const double value[3] = {{cycles->late[0][{place}], cycles->late[1][{place}],"
            f" cycles->late[2][{place}]}};\n        torque[{each.row}] += rate(cycles->clock, value); /* {each.effect} */\n    }}"
            for place, each in enumerate(late)
        ),
    )
    return DECLARED.format(**named), source


def across_in_c(model: ExportedModel) -> str:
    """Statements for the torque of gravity along the directions across it, where a formula asks for it."""
    if not model.across:
        return ""
    return (
        "    double across_1[N], across_2[N], still[N];\n"
        "    for (int j = 0; j < N; j++) still[j] = 0.0;\n"
        "    torque_under(ACROSS[0], q, still, still, payload, across_1);\n"
        "    torque_under(ACROSS[1], q, still, still, payload, across_2);\n"
    )


def _line(model: ExportedModel, torque: Torque, place: str | None) -> str:
    """A torque added, or what is differentiated put into its place."""
    added = f"torque[{torque.row}] +=" if place is None else f"{place} ="
    return f"    {added} {torque_text(model, torque, C)}; /* {torque.effect} */"


def _text(lines) -> str:
    return "".join(f"{line}\n" for line in lines)
