"""Faults × phases on the bus, each driven through a whole acquisition (`bench.py`), and what is asked of every cell."""

from dataclasses import dataclass
from typing import Any

from daq.rig import Rig
from daq.safety import StopCause
from drivers.simulated.faults import ENCODER_STANDS, SHOWN_STANDS, PlannedFault
from tests.faults.bench import Mischief, Outcome, Stage, bench_rig, is_safe, run
from tests.faults.processes import CLOCK_KINDS, PROCESS_KINDS, undone

PHASES = ("before", "checked", "streaming", "enabled", "slow", "fast", "stopping")
"""when a fault begins: before the rig is checked, after that, armed and without power, with power, in slow and in fast motion,
while an operator's stop brakes"""
LONGEST = 0.6
"""s from the fault until the axis has no power, where the fault needs a stop"""
FARTHEST = 0.6
"""rad, likewise"""


@dataclass(frozen=True)
class Fault:
    """One fault.

    parts : fault commands of object 0x2010 and their values, which begin together
    goes_on : whether a motion may go on with it
    harmless_before : whether it may where it happened before the session was armed
    mischief : what happens beside, or instead: to a process or a clock
    changes : of the rig's settings, for the fault to be seen in simulated time
    judged : whether the way and the time to rest are; not where the wall clock decides, of which simulated time knows nothing
    """

    name: str
    parts: tuple[tuple[str, int], ...] = ()
    goes_on: bool = False
    harmless_before: bool = False
    kind: str = "bus"
    mischief: Mischief | None = None
    changes: tuple[tuple[str, Any], ...] = ()
    judged: bool = True

    def begin(self, stage: Stage) -> None:
        """All of it, now."""
        for name, value in self.parts:
            planned = PlannedFault(fault=name, value=value)
            stage.plant.nodes[0].faults.command(planned.subindex, planned.value)
        if self.mischief is not None:
            self.mischief(stage)


PROCESSES = tuple(Fault(kind="process", **kind) for kind in PROCESS_KINDS)
CLOCKS = tuple(Fault(kind="time", **kind) for kind in CLOCK_KINDS)
NOTHING = (("heartbeat", 1),)
"""a planned fault that changes nothing: it only says when the phase has come"""
RUNS_AWAY = ("run-away", 1_500_000)
FAULTS = (
    *(
        Fault(f"EMCY 0x{code:04X}", (("emergency", code),))
        for code in (
            0x1000,
            0x2310,
            0x3120,
            0x4310,
            0x5112,
            0x6100,
            0x7121,
            0x7305,
            0x8130,
            0x8611,
            0x7300,
            0x8120,
            0x8400,
            0x8500,
            0x9000,
            0xFF00,
        )
    ),
    Fault("feedback flips its sign", (("flip-feedback", 1),)),
    Fault("feedback jumps by 0.01 rad", (("glitch", 20_000),), goes_on=True),
    Fault("feedback jumps by 0.001 rad", (("glitch", 2_000),), goes_on=True),
    Fault("feedback jumps by 0.1 rad", (("glitch", 200_000),), goes_on=True),
    Fault("encoder stands", (("feedback-stands", ENCODER_STANDS),)),
    Fault("shown position stands", (("feedback-stands", SHOWN_STANDS),)),
    Fault("drive runs away", (RUNS_AWAY,)),
    Fault("drive runs away, ignores controlwords", (RUNS_AWAY, ("disobey", 1))),
    Fault("drive runs away, ignores everything", (RUNS_AWAY, ("disobey", 1), ("deaf-to-nmt", 1))),
    Fault("drive ignores controlwords", (("disobey", 1),), goes_on=True),
    Fault("node freezes", (("freeze", 1),)),
    Fault("node in NMT STOPPED", (("nmt-state", 4),)),
    Fault("node in NMT PRE-OPERATIONAL", (("nmt-state", 127),)),
    Fault("node boots anew", (("restart", 1),)),
    Fault("heartbeat of the node ends", (("heartbeat", 0),), goes_on=True),
    Fault("one in a hundred TPDOs lost", (("lose", 10),), goes_on=True),
    Fault("one in ten TPDOs a cycle late", (("late", 100),), goes_on=True),
    Fault("drive keeps its mode", (("keep-mode", 1),), goes_on=True),
    Fault("all TPDOs lost", (("lose", 1000),)),
    Fault("half of the TPDOs lost", (("lose", 500),), goes_on=True),
    Fault("TPDOs a cycle late", (("late", 1000),), goes_on=True),
    Fault("TPDOs sent twice", (("double", 1000),), goes_on=True),
    Fault("current limit falls to 5 %", (("saturate", 50),), goes_on=True),
    Fault("current limit falls to 50 %", (("saturate", 500),), goes_on=True),
    Fault("torque demand shown as 0", (("current-stuck", 1),), goes_on=True),
    Fault("one SYNC of another master", (("foreign-sync", 1),)),
    Fault("50 SYNCs of another master", (("foreign-sync", 50),)),
    Fault("setpoints of another master", (("foreign-setpoint", 3000),)),
    Fault("NMT stop of another master", (("foreign-nmt", 2),)),
    Fault("setpoints of another master, close to ours", (("foreign-setpoint", 50),)),
    Fault("NMT reset of another master", (("foreign-nmt", 129),)),
    Fault("NMT pre-operational of another master", (("foreign-nmt", 128),)),
    Fault("NMT reset communication of another master", (("foreign-nmt", 130),)),
    Fault("NMT start of another master", (("foreign-nmt", 1),)),
    *PROCESSES,
    *CLOCKS,
)


@dataclass(frozen=True)
class Cell:
    """What became of one fault in one phase."""

    fault: Fault
    phase: str
    outcome: Outcome

    @property
    def failures(self) -> list[str]:
        """What does not hold; nothing where all does."""
        outcome, found = self.outcome, []
        alarmed = "emergency stop" in outcome.ended_alarm
        if not is_safe(outcome):
            found.append(
                f"power {outcome.powered}, {outcome.speed:.2f} rad/s at the end, and nobody was told"
            )
        if outcome.trace.fault_at is None:
            return found
        done = outcome.reason.cause is StopCause.PLAN_DONE
        early = self.fault.harmless_before and self.phase in ("before", "checked")
        if done and not self.fault.goes_on and not early:
            found.append("the plan went on")
        if self.fault.judged and not done and not alarmed and not self.fault.goes_on:
            if outcome.powered_for > LONGEST:
                found.append(f"power for {outcome.powered_for:.2f} s")
            if outcome.travel > FARTHEST:
                found.append(f"{outcome.travel:.2f} rad")
        if outcome.reason.cause is StopCause.INTERNAL:
            found.append("an error of ours")
        return found

    @property
    def words(self) -> str:
        """For the table."""
        outcome = self.outcome
        if self.failures:
            return f"**fails**: {'; '.join(self.failures)}"
        if outcome.trace.fault_at is None:
            return "not reached"
        if outcome.reason.cause is StopCause.PLAN_DONE:
            return "goes on"
        seen = f"{outcome.travel:.2f} rad, {outcome.powered_for:.2f} s"
        if outcome.ended_alarm:
            return f"{outcome.reason.cause.value}; told: emergency stop"
        cut = ", cut" if "power was cut" in outcome.reason.words else ""
        return f"{outcome.reason.cause.value}{cut}; {seen}"


def cell(fault: Fault, phase: str) -> Cell:
    """Drive one cell."""
    with undone():
        return Cell(fault, phase, _run(fault, phase))


def _run(fault: Fault, phase: str) -> Outcome:
    changes = dict(fault.changes)
    if phase in ("before", "checked"):
        return run(_rig(changes), **{phase: fault.begin})
    planned = [
        {
            "fault": name,
            "value": value,
            "phase": phase,
            "speed": 50.0,
            "after": 30 if phase == "streaming" else 3,
        }
        for name, value in fault.parts or NOTHING
    ]
    stop_when = None
    if phase == "stopping":

        def stop_when(plant: Any, _: Any) -> bool:
            return abs(plant.mechanism.joint_velocity) > 0.5

    return run(_rig(changes, planned=planned), stop_when=stop_when, triggered=fault.mischief)


def _rig(changes: dict[str, Any], **faults: Any) -> Rig:
    rig = bench_rig(**faults)
    supervision = changes.pop("supervision", {})
    return rig.model_copy(update={**changes, "supervision": rig.supervision.model_copy(update=supervision)})
