"""Rigs, plans of their motion, and the sessions that are measured on them."""

from typing import Literal, overload

from api.client.connection import Connection, view_of
from api.service.job_documents import JobView
from api.service.plan_documents import PlanSummary, PlanView
from api.service.rig_documents import HomingView, ResetJointView, RigSummary, RigView, Stopped
from api.service.session_documents import RigCheckView, SessionSummary, TypedPayload


class RigCalls(Connection):
    """What a client can ask of rigs, plans and sessions."""

    def rigs(self) -> list[RigSummary]:
        """All rigs and who is at them."""
        return self._all(RigSummary, "/rigs")

    def rig(self, rig: str) -> RigView:
        """One rig: settings, operator, the session under way."""
        return self._one(RigView, f"/rigs/{rig}")

    def take(self, rig: str) -> RigSummary:
        """Have the rig."""
        return self._done(RigSummary, f"/rigs/{rig}/take")

    def release(self, rig: str) -> RigSummary:
        """Give the rig back."""
        return self._done(RigSummary, f"/rigs/{rig}/release")

    def home(self, rig: str, joint: str, method: int | None = None, reset_faults: bool = False) -> HomingView:
        """Home one joint; returns at once. The axis moves: stand by the machine."""
        order = {"joint": joint, "method": method, "reset_faults": reset_faults}
        return self._done(HomingView, f"/rigs/{rig}/homing", order)

    def reset_drives(self, rig: str) -> list[ResetJointView]:
        """Reset the faults of a rig's drives and take the power of those that have some; no zero is changed."""
        address = f"/rigs/{rig}/reset"
        return [view_of(ResetJointView, each, address) for each in self._post(address)]

    def homing(self, rig: str) -> HomingView | None:
        """The homing under way on a rig, or the last one."""
        address = f"/rigs/{rig}/homing"
        answer = self._get(address)
        return None if answer is None else view_of(HomingView, answer, address)

    def stop(self, rig: str) -> bool:
        """Bring the rig to rest, now; returns whether something was under way.

        Whatever the service is doing: by a new connection, to the stop's own port where the service has one.
        """
        address = f"/rigs/{rig}/stop"
        return view_of(Stopped, self._post_at_once(address), address).stopped

    def make_plan(
        self, rig: str, name: str, seconds: float = 60.0, model: str = "load-velocity", seed: int = 0
    ) -> JobView:
        """Plan an excitation (a job whose `result.plan` is its id)."""
        wanted = {"rig": rig, "name": name, "seconds": seconds, "model": model, "seed": seed}
        return self._begin("/plans", wanted)

    def plans(self) -> list[PlanSummary]:
        """All plans, the newest first."""
        return self._all(PlanSummary, "/plans")

    def plan(self, plan: str) -> PlanView:
        """One plan with its phases in closed form, and what was found when it was made."""
        return self._one(PlanView, f"/plans/{plan}")

    def create_session(
        self,
        experiment: str,
        rig: str,
        plan: str,
        payload: TypedPayload | str,
        role: Literal["identification", "validation"] = "identification",
    ) -> SessionSummary:
        """Prepare a payload session; `payload` is the name of one of the rig's, or another with its mass, com and inertia."""
        carried = TypedPayload(name=payload) if isinstance(payload, str) else payload
        mounted = carried.model_dump(mode="json", exclude_none=True)
        new = {"rig": rig, "plan": plan, "payload": mounted, "role": role}
        return self._done(SessionSummary, f"/experiments/{experiment}/sessions", new)

    def session(self, experiment: str, session: str) -> SessionSummary:
        """One session."""
        return self._one(SessionSummary, f"/experiments/{experiment}/sessions/{session}")

    @overload
    def step(self, experiment: str, session: str, step: Literal["check"]) -> RigCheckView: ...

    @overload
    def step(self, experiment: str, session: str, step: Literal["stop"]) -> Stopped: ...

    @overload
    def step(
        self,
        experiment: str,
        session: str,
        step: Literal["weigh", "confirm", "arm", "start", "recover"],
        mass: float | None = None,
    ) -> SessionSummary: ...

    def step(
        self,
        experiment: str,
        session: str,
        step: Literal["check", "weigh", "confirm", "arm", "start", "stop", "recover"],
        mass: float | None = None,
    ) -> RigCheckView | Stopped | SessionSummary:
        """Take one step of a session: check, weigh, confirm, arm, start, stop, recover.

        mass : kg, as the payload was weighed; without it the service's scale is asked
        """
        kind = {"check": RigCheckView, "stop": Stopped}.get(step, SessionSummary)
        address = f"/experiments/{experiment}/sessions/{session}/{step}"
        return self._done(kind, address, {"mass": mass} if step == "weigh" else None)

    def recover(self, experiment: str, session: str) -> SessionSummary:
        """Close a recording that was cut off; it is identified with the others if there is enough of it."""
        return self._done(SessionSummary, f"/experiments/{experiment}/sessions/{session}/recover")

    def admit(self, experiment: str, session: str) -> SessionSummary:
        """Use a session that ended early, after a look at it."""
        return self._done(SessionSummary, f"/experiments/{experiment}/sessions/{session}/admit")
