"""The client: all that can be asked of one service, its calls sorted by what they are about."""

from api.client.drive_tables import DriveTableCalls
from api.client.experiments import ExperimentCalls
from api.client.jobs import JobCalls
from api.client.models import ModelCalls
from api.client.proofs import ProofCalls
from api.client.rigs import RigCalls
from api.service.account_documents import Me


class Client(ExperimentCalls, ModelCalls, ProofCalls, DriveTableCalls, JobCalls, RigCalls):
    """One service.

    address : such as http://localhost:8000
    token   : a bearer token (`coulomb users token NAME`); None on this machine while nobody has an account
    timeout : s for one answer
    """

    def me(self) -> Me:
        """Who the service takes this client for."""
        return self._one(Me, "/me")
