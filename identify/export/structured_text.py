"""The model in structured text (IEC 61131-3, third edition), for a programmable controller: one function block."""

from __future__ import annotations

import re

from identify.export.c_code import c_name
from identify.export.exported_model import ExportedModel, Memory, Torque
from identify.export.expression_code import Dialect, literal, one_line, structured_text_dialect, torque_text
from identify.export.structured_text_cycles import RATE, cycles_in_structured_text, passes_in_structured_text

FUNCTIONS = """FUNCTION {block}_SIGN : LREAL
VAR_INPUT
    X : LREAL;
END_VAR
IF X > 0.0 THEN
    {block}_SIGN := 1.0;
ELSIF X < 0.0 THEN
    {block}_SIGN := -1.0;
ELSE
    {block}_SIGN := 0.0;
END_IF;
END_FUNCTION

FUNCTION {block}_TANH : LREAL
VAR_INPUT
    X : LREAL;
END_VAR
VAR
    E : LREAL;
END_VAR
E := EXP(-2.0 * ABS(X));
{block}_TANH := {block}_SIGN(X) * (1.0 - E) / (1.0 + E);
END_FUNCTION
"""

FINITE = """
FUNCTION {block}_FINITE : LREAL
VAR_INPUT
    X : LREAL;
END_VAR
(* no comparison holds with what is no number *)
IF ABS(X) < 1.0E308 THEN
    {block}_FINITE := X;
ELSE
    {block}_FINITE := 0.0;
END_IF;
END_FUNCTION
"""

TAKEN = frozenset(
    re.findall(
        r"\w+",
        """
    ABS ACOS ADD AND ARRAY ASIN AT ATAN BOOL BY BYTE CASE CONCAT CONFIGURATION CONTINUE COS DATE DELETE DIV DO DT DWORD ELSE
    ELSIF EQ EXIT EXP EXPT FALSE FIND FOR FROM FUNCTION GE GT IF INSERT INT LE LEFT LEN LIMIT LINT LN LOG LREAL LT LWORD MAX MID
    MIN MOD MOVE MUL MUX NE NOT NULL OF ON OR PROGRAM REAL REF REPEAT REPLACE RESOURCE RETURN RIGHT ROL ROR SEL SHL SHR SIN SINT
    SQRT STEP STRING STRUCT SUB TAN TASK THEN TIME TO TOD TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNTIL USINT VAR WHILE WITH
    WORD WSTRING XOR X E
    ABSTRACT ACTION ADR AND_THEN ANY BIT CHAR CLASS CTD CTU CTUD DATE_AND_TIME EXTENDS FINAL FUNCTIONBLOCK FUNCTION_BLOCK F_EDGE
    F_TRIG IMPLEMENTS INITIAL_STEP INTERFACE INTERNAL JMP LDATE LDT LTIME LTOD METHOD NAMESPACE OR_ELSE OVERLAP OVERRIDE
    PERSISTENT POINTER PRIVATE PROPERTY PROTECTED PUBLIC READ_ONLY READ_WRITE REFERENCE REF_TO RETAIN NON_RETAIN RS R_EDGE R_TRIG
    SEMA SIZEOF SR SUPER THIS TIME_OF_DAY TOF TON TP UNION USING WCHAR XINT XWORD
    Q DQ DDQ T TEMP PAYLOAD TORQUE LAST GRAVITY DH_ALPHA DH_D DH_THETA DH_R PRISMATIC BODY LINK LOAD DIRECTION WHOLE MOTOR_DQ
    MOTOR_DDQ TURN PLACE FORCE MOMENT RATE CHANGE ACCELERATION WA WB ANGLE ALONG COS_A SIN_A COS_T SIN_T AX AY AZ UX UY UZ J K
    STATE BEFORE BEGUN TRAVEL RESET PERIOD NOW CLOCK RATES SUMS EARLY LATE LATE_CLOCK SETTLED SLOPE MOVED PASS
    MOVED_DQ MOVED_DDQ PULL ACROSS_1 ACROSS_2
    """,
    )
)
"""words of IEC 61131-3 and of CODESYS and TwinCAT, and names of variables inside the exported text"""

FAMILIES = re.compile(r"^(END|VAR|ANY|TO)_|_TO_[A-Z]*(INT|REAL|BOOL|BYTE|WORD|STRING|CHAR|TIME|DATE|TOD|DT)$")
"""ends of blocks, kinds of variables and types, conversions (REAL_TO_INT): more words of these languages than a list has"""

RECURSION = """(* tau_out of eq. (6): inertia, Coriolis, centrifugal and gravity torque, by the recursion of Newton and Euler *)
FOR K := 0 TO 2 DO
    RATE[K] := 0.0;
    CHANGE[K] := 0.0;
    ACCELERATION[K] := -GRAVITY[K];
END_FOR;
FOR J := 0 TO LAST DO
    ANGLE := DH_THETA[J] + (1.0 - PRISMATIC[J]) * Q[J];
    ALONG := DH_R[J] + PRISMATIC[J] * Q[J];
    COS_A := COS(DH_ALPHA[J]);
    SIN_A := SIN(DH_ALPHA[J]);
    COS_T := COS(ANGLE);
    SIN_T := SIN(ANGLE);
    TURN[J, 0] := COS_T;
    TURN[J, 1] := -SIN_T;
    TURN[J, 2] := 0.0;
    TURN[J, 3] := COS_A * SIN_T;
    TURN[J, 4] := COS_A * COS_T;
    TURN[J, 5] := -SIN_A;
    TURN[J, 6] := SIN_A * SIN_T;
    TURN[J, 7] := SIN_A * COS_T;
    TURN[J, 8] := COS_A;
    PLACE[J, 0] := DH_D[J];
    PLACE[J, 1] := -SIN_A * ALONG;
    PLACE[J, 2] := COS_A * ALONG;
    (* acceleration of the frame's origin: + change x place + rate x (rate x place) *)
    AX := RATE[1] * PLACE[J, 2] - RATE[2] * PLACE[J, 1];
    AY := RATE[2] * PLACE[J, 0] - RATE[0] * PLACE[J, 2];
    AZ := RATE[0] * PLACE[J, 1] - RATE[1] * PLACE[J, 0];
    UX := ACCELERATION[0] + CHANGE[1] * PLACE[J, 2] - CHANGE[2] * PLACE[J, 1] + RATE[1] * AZ - RATE[2] * AY;
    UY := ACCELERATION[1] + CHANGE[2] * PLACE[J, 0] - CHANGE[0] * PLACE[J, 2] + RATE[2] * AX - RATE[0] * AZ;
    UZ := ACCELERATION[2] + CHANGE[0] * PLACE[J, 1] - CHANGE[1] * PLACE[J, 0] + RATE[0] * AY - RATE[1] * AX;
    FOR K := 0 TO 2 DO
        ACCELERATION[K] := TURN[J, K] * UX + TURN[J, 3 + K] * UY + TURN[J, 6 + K] * UZ;
        WA[K] := TURN[J, K] * RATE[0] + TURN[J, 3 + K] * RATE[1] + TURN[J, 6 + K] * RATE[2];
        WB[K] := TURN[J, K] * CHANGE[0] + TURN[J, 3 + K] * CHANGE[1] + TURN[J, 6 + K] * CHANGE[2];
    END_FOR;
    FOR K := 0 TO 2 DO
        RATE[K] := WA[K];
        CHANGE[K] := WB[K];
    END_FOR;
    IF PRISMATIC[J] > 0.5 THEN
        ACCELERATION[0] := ACCELERATION[0] + 2.0 * RATE[1] * DQ[J];
        ACCELERATION[1] := ACCELERATION[1] - 2.0 * RATE[0] * DQ[J];
        ACCELERATION[2] := ACCELERATION[2] + DDQ[J];
    ELSE
        CHANGE[0] := CHANGE[0] + RATE[1] * DQ[J];
        CHANGE[1] := CHANGE[1] - RATE[0] * DQ[J];
        CHANGE[2] := CHANGE[2] + DDQ[J];
        RATE[2] := RATE[2] + DQ[J];
    END_IF;
    FOR K := 0 TO 9 DO
        BODY[K] := LINK[J, K];
        IF J = LAST THEN
            BODY[K] := BODY[K] + PAYLOAD[K];
        END_IF;
    END_FOR;
    (* force and moment of the link, the last one's with the payload, at its frame's origin *)
    AX := RATE[1] * BODY[8] - RATE[2] * BODY[7];
    AY := RATE[2] * BODY[6] - RATE[0] * BODY[8];
    AZ := RATE[0] * BODY[7] - RATE[1] * BODY[6];
    FORCE[J, 0] := BODY[9] * ACCELERATION[0] + CHANGE[1] * BODY[8] - CHANGE[2] * BODY[7]
        + RATE[1] * AZ - RATE[2] * AY;
    FORCE[J, 1] := BODY[9] * ACCELERATION[1] + CHANGE[2] * BODY[6] - CHANGE[0] * BODY[8]
        + RATE[2] * AX - RATE[0] * AZ;
    FORCE[J, 2] := BODY[9] * ACCELERATION[2] + CHANGE[0] * BODY[7] - CHANGE[1] * BODY[6]
        + RATE[0] * AY - RATE[1] * AX;
    AX := BODY[0] * RATE[0] + BODY[1] * RATE[1] + BODY[2] * RATE[2];
    AY := BODY[1] * RATE[0] + BODY[3] * RATE[1] + BODY[4] * RATE[2];
    AZ := BODY[2] * RATE[0] + BODY[4] * RATE[1] + BODY[5] * RATE[2];
    MOMENT[J, 0] := BODY[0] * CHANGE[0] + BODY[1] * CHANGE[1] + BODY[2] * CHANGE[2] + RATE[1] * AZ - RATE[2] * AY
        + BODY[7] * ACCELERATION[2] - BODY[8] * ACCELERATION[1];
    MOMENT[J, 1] := BODY[1] * CHANGE[0] + BODY[3] * CHANGE[1] + BODY[4] * CHANGE[2] + RATE[2] * AX - RATE[0] * AZ
        + BODY[8] * ACCELERATION[0] - BODY[6] * ACCELERATION[2];
    MOMENT[J, 2] := BODY[2] * CHANGE[0] + BODY[4] * CHANGE[1] + BODY[5] * CHANGE[2] + RATE[0] * AY - RATE[1] * AX
        + BODY[6] * ACCELERATION[1] - BODY[7] * ACCELERATION[0];
END_FOR;
FOR J := LAST TO 0 BY -1 DO
    LOAD[J] := (1.0 - PRISMATIC[J]) * MOMENT[J, 2] + PRISMATIC[J] * FORCE[J, 2] + LINK[J, 10] * DDQ[J];
    IF J > 0 THEN
        FOR K := 0 TO 2 DO
            WA[K] := TURN[J, 3 * K] * FORCE[J, 0] + TURN[J, 3 * K + 1] * FORCE[J, 1] + TURN[J, 3 * K + 2] * FORCE[J, 2];
            WB[K] := TURN[J, 3 * K] * MOMENT[J, 0] + TURN[J, 3 * K + 1] * MOMENT[J, 1] + TURN[J, 3 * K + 2] * MOMENT[J, 2];
        END_FOR;
        MOMENT[J - 1, 0] := MOMENT[J - 1, 0] + WB[0] + PLACE[J, 1] * WA[2] - PLACE[J, 2] * WA[1];
        MOMENT[J - 1, 1] := MOMENT[J - 1, 1] + WB[1] + PLACE[J, 2] * WA[0] - PLACE[J, 0] * WA[2];
        MOMENT[J - 1, 2] := MOMENT[J - 1, 2] + WB[2] + PLACE[J, 0] * WA[1] - PLACE[J, 1] * WA[0];
        FOR K := 0 TO 2 DO
            FORCE[J - 1, K] := FORCE[J - 1, K] + WA[K];
        END_FOR;
    END_IF;
END_FOR;
"""


def structured_text(model: ExportedModel, stem: str) -> str:
    """The text of the function block and of the two functions that it calls.

    It is called once a cycle with the motion of that cycle; states stay in the block from call to call. With derivatives over
    time the torque is that of the motion some calls before.
    """
    n, last, geometry = model.joints, model.joints - 1, model.geometry
    block = block_name(stem)
    dialect = structured_text_dialect(block)
    sign = dialect.functions["sign"]
    functions = FUNCTIONS + (FINITE if model.may_have_no_value else "") + (RATE if model.latency else "")
    functions = functions.format(block=block)
    cycles = cycles_in_structured_text(model, block, dialect) if model.latency else None
    links = model.standard.reshape(n, -1)
    states = model.memories
    one = f"ARRAY[0..{last}] OF LREAL"
    three = f"ARRAY[0..{last}, 0..2] OF LREAL"

    def constants(values) -> str:
        # the second edition of the standard has no brackets in initial values
        return ", ".join(literal(float(value)).strip("()") for value in values)

    names = _comment(", ".join(geometry.names))
    remarks = "".join(f"\n   Remark: {_comment(remark)}." for remark in model.remarks)
    kept = ""
    if states or cycles:
        kept = "    BEGUN : BOOL := FALSE;\n"
    if states:
        kept += (
            f"    STATE : ARRAY[0..{len(states) - 1}] OF LREAL;\n    BEFORE : {one};\n    TRAVEL : LREAL;\n"
        )
    if cycles:
        kept += cycles.variables
    passes = ""
    if model.slopes or model.across:
        passes = f"    MOVED : {one};\n    PASS : INT;\n"
    if model.slopes:
        passes += f"    SLOPE : {one};\n"
    if model.across:
        passes += f"    ACROSS_1, ACROSS_2, MOVED_DQ, MOVED_DDQ : {one};\n    PULL : ARRAY[0..2] OF LREAL;\n"
    shown = f" (* of the motion of {model.latency} calls before *)" if cycles else ""
    further = cycles.inputs if cycles else ""
    if kept:
        further += "    RESET : BOOL := FALSE; (* TRUE: the motion of this call is the first *)\n"
    declared = f"""(* Inverse dynamics of {_comment(model.experiment)}, model {_comment(model.name)}:
   torque of each joint from its motion. Written by coulomb.
   SI units, joint space: rad or m, s, kg, N m or N. Joints from the base: {names}.{remarks} *)
{functions}
FUNCTION_BLOCK {block}
VAR_INPUT
    Q : {one};
    DQ : {one};
    DDQ : {one};
    T : LREAL := 0.0; (* s since the machine began to move *)
    TEMP : {one} := [{constants([20.0] * n)}]; (* deg C *)
    PAYLOAD : ARRAY[0..9] OF LREAL; (* XX XY XZ YY YZ ZZ MX MY MZ M of a body on the last link, in its frame *)
{further}END_VAR
VAR_OUTPUT
    TORQUE : {one};{shown}
END_VAR
VAR
    LAST : INT := {last};
    GRAVITY : ARRAY[0..2] OF LREAL := [{constants(geometry.gravity)}];
    (* modified Denavit-Hartenberg frames (Khalil-Kleinfinger) *)
    DH_ALPHA : {one} := [{constants(geometry.alpha)}];
    DH_D : {one} := [{constants(geometry.d)}];
    DH_THETA : {one} := [{constants(geometry.theta)}];
    DH_R : {one} := [{constants(geometry.r)}];
    PRISMATIC : {one} := [{constants(geometry.prismatic)}];
    (* XX XY XZ YY YZ ZZ MX MY MZ M Ia of each link about its own frame's origin *)
    LINK : ARRAY[0..{last}, 0..10] OF LREAL := [{constants(links.ravel())}];
    LOAD : {one};
    DIRECTION : {one};
    WHOLE : {one};
    MOTOR_DQ : {one};
    MOTOR_DDQ : {one};
    TURN : ARRAY[0..{last}, 0..8] OF LREAL;
    PLACE : {three};
    FORCE : {three};
    MOMENT : {three};
    RATE : ARRAY[0..2] OF LREAL;
    CHANGE : ARRAY[0..2] OF LREAL;
    ACCELERATION : ARRAY[0..2] OF LREAL;
    WA : ARRAY[0..2] OF LREAL;
    WB : ARRAY[0..2] OF LREAL;
    BODY : ARRAY[0..9] OF LREAL;
    ANGLE, ALONG, COS_A, SIN_A, COS_T, SIN_T, AX, AY, AZ, UX, UY, UZ : LREAL;
    J, K : INT;
{kept}{passes}END_VAR
"""
    body = [passes_in_structured_text(model, RECURSION)]
    if kept:
        body.append("IF RESET THEN\n    BEGUN := FALSE;\nEND_IF;\n")
    for joint in range(n):
        body.append(f"DIRECTION[{joint}] := {sign}(DQ[{joint}]);\n")
        for name, speed in (("MOTOR_DQ", "DQ"), ("MOTOR_DDQ", "DDQ")):
            terms = [
                f"{literal(float(share))} * {speed}[{row}]"
                for row, share in enumerate(model.shares[:, joint])
                if share
            ]
            body.append(f"{name}[{joint}] := {' + '.join(terms) or '0.0'};\n")
    if states:
        body.append(_memory(states, n, sign))
    body += [f"TORQUE[{joint}] := LOAD[{joint}];\n" for joint in range(n)]
    first, late = model.in_order
    body += [_line(model, torque, dialect) for torque in first if not torque.derivative]
    if cycles:
        body.append(cycles.early)
        dialect = cycles.dialect
    if late:
        body += [f"WHOLE[{joint}] := TORQUE[{joint}];\n" for joint in range(n)]
        body += [_line(model, torque, dialect) for torque in late if not torque.derivative]
    if cycles:
        body.append(cycles.late)
    if kept:
        body.append("BEGUN := TRUE;\n")
    return declared + "".join(body) + "END_FUNCTION_BLOCK\n"


def _memory(states: tuple[Memory, ...], joints: int, sign: str) -> str:
    """Statements that move the states on since the last call."""
    lines = []
    for index, memory in enumerate(states):
        distance, row = literal(memory.distance), memory.row
        travel = f"TRAVEL := Q[{row}] - BEFORE[{row}];\n"
        if memory.kind == "play":
            lines.append(
                f"IF NOT BEGUN THEN\n    STATE[{index}] := -0.5 * DIRECTION[{row}];\nELSE\n    {travel}"
                f"    STATE[{index}] := LIMIT(-0.5, STATE[{index}] - TRAVEL / {distance}, 0.5);\nEND_IF;\n"
            )
            continue
        lines.append(
            f"IF NOT BEGUN THEN\n    STATE[{index}] := DIRECTION[{row}];\nELSE\n    {travel}"
            f"    IF ABS(TRAVEL) > 0.0 THEN\n"
            f"        STATE[{index}] := {sign}(TRAVEL) + (STATE[{index}] - {sign}(TRAVEL)) * EXP(-ABS(TRAVEL) / {distance});\n"
            "    END_IF;\nEND_IF;\n"
        )
    lines += [f"BEFORE[{joint}] := Q[{joint}];\n" for joint in range(joints)]
    return "".join(lines)


def _line(model: ExportedModel, torque: Torque, dialect: Dialect) -> str:
    text = torque_text(model, torque, dialect)
    return f"(* {torque.effect} *)\nTORQUE[{torque.row}] := TORQUE[{torque.row}] + {text};\n"


def block_name(stem: str) -> str:
    """A name that the standard allows for the block, made of a file's name: letters, digits and single underscores.

    A name could be a word of the language or a variable of the block (IF, END_IF, REAL, LOAD); those get a prefix.
    """
    name = re.sub("_+", "_", c_name(stem).upper())
    return f"MODEL_{name}" if name in TAKEN or FAMILIES.search(name) else name


def _comment(text: str) -> str:
    """Text that can neither end a comment nor begin one inside it, where comments nest (IEC 61131-3, third edition)."""
    return one_line(text).replace("*)", "* )").replace("(*", "( *")
