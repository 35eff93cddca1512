"""Proofs on the drive: torque computed by a model, sent as feedforward along a plan, and what that did."""

from typing import Literal

from api.client.connection import Connection, ServiceError
from api.service.job_documents import JobView
from api.service.proof_documents import ProofView
from api.service.session_documents import SessionSummary
from identify.results.compensation import CompensationDocument


class ProofCalls(Connection):
    """What a client can ask about proofs on the drive."""

    def prepare_proof(
        self,
        experiment: str,
        rig: str,
        plan: str,
        payload: str,
        model: str | None = None,
        part: Literal["whole", "friction"] = "whole",
        share: float = 0.6,
    ) -> JobView:
        """Compute the feedforward torque of a plan (a job whose `result.proof` is its number); nothing moves."""
        wanted = {"rig": rig, "plan": plan, "payload": payload, "model": model, "part": part, "share": share}
        return self._begin(f"/experiments/{experiment}/proofs", wanted)

    def proofs(self, experiment: str) -> list[ProofView]:
        """All proofs on the drive, the newest first."""
        return self._all(ProofView, f"/experiments/{experiment}/proofs")

    def proof(self, experiment: str, proof: str) -> ProofView:
        """One proof: what is sent, its two drives, and which comes next."""
        return self._one(ProofView, f"/experiments/{experiment}/proofs/{proof}")

    def proof_result(self, experiment: str, proof: str) -> CompensationDocument:
        """What a proof did to the following error.

        Raises ServiceError with status 404 until feedforward torque was sent.
        """
        result = self.proof(experiment, proof).result
        if result is None:
            raise ServiceError(404, {"detail": f"proof {proof}: no feedforward torque was sent yet"})
        return result

    def prepare_drive(self, experiment: str, proof: str, drive: Literal["without", "with"]) -> SessionSummary:
        """A session for one of a proof's drives, to be taken through its steps as any other (`step`)."""
        return self._done(SessionSummary, f"/experiments/{experiment}/proofs/{proof}/drives/{drive}")
