"""Rigs, plans of their motion, and the sessions that are measured on them."""

from typing import Any, Literal

from api.client.connection import Connection
from api.service.job_documents import JobView
from identify.results.document import Json


class RigCalls(Connection):
    """What a client can ask of rigs, plans and sessions."""

    def rigs(self) -> list[Json]:
        """All rigs and who is at them."""
        return self._get("/rigs")

    def rig(self, rig: str) -> Json:
        """One rig: settings, operator, the session under way."""
        return self._get(f"/rigs/{rig}")

    def take(self, rig: str) -> Json:
        """Have the rig."""
        return self._post(f"/rigs/{rig}/take")

    def release(self, rig: str) -> Json:
        """Give the rig back."""
        return self._post(f"/rigs/{rig}/release")

    def home(self, rig: str, joint: str, method: int | None = None, reset_faults: bool = False) -> Json:
        """Home one joint; returns at once. The axis moves: stand by the machine."""
        return self._post(
            f"/rigs/{rig}/homing", {"joint": joint, "method": method, "reset_faults": reset_faults}
        )

    def reset_drives(self, rig: str) -> Json:
        """Reset the faults of a rig's drives and take the power of those that have some; no zero is changed."""
        return self._post(f"/rigs/{rig}/reset")

    def homing(self, rig: str) -> Json | None:
        """The homing under way on a rig, or the last one."""
        return self._get(f"/rigs/{rig}/homing")

    def stop(self, rig: str) -> bool:
        """Bring the rig to rest, now; returns whether something was under way.

        Whatever the service is doing: by a new connection, to the stop's own port where the service has one.
        """
        return self._post_at_once(f"/rigs/{rig}/stop")["stopped"]

    def make_plan(
        self, rig: str, name: str, seconds: float = 60.0, model: str = "load-velocity", seed: int = 0
    ) -> JobView:
        """Plan an excitation (a job whose `result.plan` is its id)."""
        wanted = {"rig": rig, "name": name, "seconds": seconds, "model": model, "seed": seed}
        return self._begin("/plans", wanted)

    def plans(self) -> list[Json]:
        """All plans, the newest first."""
        return self._get("/plans")

    def create_session(
        self,
        experiment: str,
        rig: str,
        plan: str,
        payload: Json,
        role: Literal["identification", "validation"] = "identification",
    ) -> Json:
        """Prepare a payload session; `payload` is {"name": …} of the rig, or with mass, com and inertia."""
        new = {"rig": rig, "plan": plan, "payload": payload, "role": role}
        return self._post(f"/experiments/{experiment}/sessions", new)

    def session(self, experiment: str, session: str) -> Json:
        """One session."""
        return self._get(f"/experiments/{experiment}/sessions/{session}")

    def step(
        self,
        experiment: str,
        session: str,
        step: Literal["check", "weigh", "confirm", "arm", "start", "stop", "recover"],
        **fields: Any,
    ) -> Json:
        """Take one step of a session: check, weigh (mass=…), confirm, arm, start, stop, recover."""
        address = f"/experiments/{experiment}/sessions/{session}/{step}"
        return self._post(address, fields if step == "weigh" else None)

    def recover(self, experiment: str, session: str) -> Json:
        """Close a recording that was cut off; it is identified with the others if there is enough of it."""
        return self._post(f"/experiments/{experiment}/sessions/{session}/recover")

    def admit(self, experiment: str, session: str) -> Json:
        """Use a session that ended early, after a look at it."""
        return self._post(f"/experiments/{experiment}/sessions/{session}/admit")
