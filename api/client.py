"""A client of the service for notebooks and scripts.

    from api.client import Client

    with Client("http://localhost:8000", token="coulomb_…") as coulomb:
        for experiment in coulomb.experiments():
            print(experiment["id"], coulomb.results(experiment["id"]).relative_error)
        job = coulomb.add_effect("rx130l-joint3", "load-friction-asymmetric", "j3")
        coulomb.wait(job, print)
        time, signals = coulomb.model_signals("rx130l-joint3", "m2", "session-00", points=2000)

SI units, joint space. Every refusal of the service is a `ServiceError` with its words.
"""

import json
import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Literal, Self

import httpx
import numpy as np
from numpy.typing import NDArray

from api.service.record_documents import CanLogImport, Dialect, RecordDescription, RecordImport
from identify.results.certificate import Certificate
from identify.results.compensation import CompensationDocument
from identify.results.diagnosis import DiagnosisDocument
from identify.results.document import Json
from identify.results.effect import CatalogueEffect
from identify.results.identification import IdentificationDocument
from identify.results.next_experiment import NextExperimentDocument
from identify.results.reading import document_of
from identify.results.simulation import SimulationDocument

Signals = dict[str, NDArray[np.float32]]
BESIDE_RESULTS = ("version", "stale", "job", "diagnosis")
"""What `/results` answers beside the identification: where it comes from, and the diagnosis, which has a call of its own."""
STOP_TIMEOUT = 2.0
"""s for the answer to a stop"""
FINAL = frozenset({"done", "failed", "cancelled", "lost"})


class ServiceError(Exception):
    """The service refused: `status` as in HTTP, `problem` the RFC 9457 document, the text its detail."""

    def __init__(self, status: int, problem: Json) -> None:
        super().__init__(problem.get("detail") or problem.get("title") or f"status {status}")
        self.status = status
        self.problem = problem


class JobFailed(Exception):
    """A job ended otherwise than done; `job` is its last state."""

    def __init__(self, job: Json) -> None:
        super().__init__(f"{job['kind']}: {job['state']}: {job['words']}")
        self.job = job


class Client:
    """One service.

    address : such as http://localhost:8000
    token   : a bearer token (`coulomb users token NAME`); None on this machine while nobody has an account
    timeout : s for one answer
    """

    def __init__(
        self, address: str, token: str | None = None, timeout: float = 30.0, http: httpx.Client | None = None
    ) -> None:
        self._http = http or httpx.Client(base_url=address, timeout=timeout)
        self._others = http is not None
        self._stop_port: str | None = None
        self._http.event_hooks["response"].append(self._note_stop_port)
        if token is not None:
            self._http.headers["Authorization"] = f"Bearer {token}"
        if http is None:
            self._http.event_hooks["response"].append(self._forget_cookies)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    # --- experiments and recordings

    def me(self) -> Json:
        """Who the service takes this client for."""
        return self._get("/me")

    def experiments(self) -> list[Json]:
        """All experiments, the one changed last first."""
        return self._get("/experiments")

    def experiment(self, experiment: str) -> Json:
        """One experiment with its payloads and sessions."""
        return self._get(f"/experiments/{experiment}")

    def create_experiment(self, name: str, rig: str) -> Json:
        """An experiment without sessions on a rig."""
        return self._post("/experiments", {"name": name, "rig": rig})

    def import_experiment(self, archive: Path | str) -> Json:
        """Store an experiment measured elsewhere: a .zip of experiment.yaml and its sessions.

        Returns the experiment and the job of its first identification.
        """
        with Path(archive).open("rb") as stream:
            return self._answer(self._http.post("/experiments/import", files={"file": stream}))

    def import_session(
        self,
        experiment: str,
        file: Path | str,
        payload: str,
        role: Literal["identification", "validation"] = "identification",
        mass: float | None = None,
    ) -> Json:
        """Add a session measured elsewhere (.csv, .csv.gz, .h5); `mass` in kg adds a payload of that name."""
        fields = {"payload": payload, "role": role} | ({"mass": str(mass)} if mass is not None else {})
        with Path(file).open("rb") as stream:
            files = {"file": (Path(file).name, stream)}
            answer = self._http.post(f"/experiments/{experiment}/sessions/import", data=fields, files=files)
        return self._answer(answer)

    def describe_records(
        self, files: Sequence[Path | str], dialect: Dialect | None = None
    ) -> list[RecordDescription]:
        """What other people's records hold, and what their columns probably are; nothing is kept there."""
        fields = dialect.model_dump(exclude_none=True) if dialect else {}
        with _opened(files) as parts:
            answer = self._answer(self._http.post("/experiments/import/columns", data=fields, files=parts))
        return [RecordDescription.model_validate(each) for each in answer]

    def import_records(
        self, files: Sequence[Path | str], settings: RecordImport, robot: Path | str | None = None
    ) -> Json:
        """Make an experiment of other people's records; `robot` is a URDF, SDF or MJCF.

        Returns the experiment, what was decided on the way, and the job of its first identification.
        """
        fields = {"settings": settings.model_dump_json()}
        with _opened(files) as parts, _opened([robot] if robot else [], "robot") as described:
            sent = [*parts, *described]
            return self._answer(self._http.post("/experiments/import/records", data=fields, files=sent))

    def import_can_logs(self, files: Sequence[Path | str], settings: CanLogImport) -> Json:
        """Make an experiment of logs of a CAN bus by the mapping of a rig, or add them to one.

        Returns the same as `import_records`.
        """
        with _opened(files) as parts:
            sent = self._http.post(
                "/experiments/import/can-logs", data={"settings": settings.model_dump_json()}, files=parts
            )
        return self._answer(sent)

    def recordings(self, experiment: str) -> list[Json]:
        """The recordings of an experiment, also those that ended badly."""
        return self._get(f"/experiments/{experiment}/recordings")

    def download(
        self,
        experiment: str,
        session: str,
        target: Path | str,
        format: Literal["original", "hdf5", "csv", "raw", "mat", "parquet", "hdf5-si"] = "original",
    ) -> Path:
        """Write a recording to the file `target`, which must not exist yet; returns its path."""
        path = Path(target)
        address = f"/experiments/{experiment}/recordings/{session}"
        with self._http.stream("GET", address, params={"format": format}) as answer:
            if answer.is_error:
                answer.read()
                self._answer(answer)
            with path.open("xb") as stream:
                for block in answer.iter_bytes():
                    stream.write(block)
        return path

    def recorded_signals(
        self,
        experiment: str,
        session: str,
        joint: int = 1,
        start: float | None = None,
        end: float | None = None,
        points: int = 2000,
    ) -> tuple[NDArray[np.float64], Signals]:
        """Time (M,) s and `position`, `command` (M,) of a joint counted from 1, between `start` and `end` s.

        More than `points` samples come as pairs of smallest and largest value.
        """
        address = f"/experiments/{experiment}/recordings/{session}/signals"
        return self._signals(address, {"joint": joint, "from": start, "to": end, "points": points})

    # --- models

    def results(self, experiment: str) -> IdentificationDocument:
        """What the identifier says over all sessions so far.

        Raises ServiceError with status 404 before the first session, and 202 while the first results are
        computed.
        """
        answer = self._http.get(f"/experiments/{experiment}/results")
        if answer.status_code == 202:
            raise ServiceError(202, {"detail": "the first results are being computed", **answer.json()})
        fields = {name: value for name, value in self._answer(answer).items() if name not in BESIDE_RESULTS}
        return document_of(IdentificationDocument, fields, str(answer.url))

    def models(self, experiment: str) -> Json:
        """All model versions and which of them is current."""
        return self._get(f"/experiments/{experiment}/models")

    def model(self, experiment: str, model: str) -> Json:
        """One model version with its newest fit and diagnosis."""
        return self._get(f"/experiments/{experiment}/models/{model}")

    def compare(self, experiment: str, first: str, second: str) -> Json:
        """Two model versions side by side."""
        return self._get(f"/experiments/{experiment}/models/compare", first=first, second=second)

    def fit(self, experiment: str, model: str = "usual", add: list[str] | None = None) -> Json:
        """Fit a model (a job); it becomes the current one."""
        return self._post(f"/experiments/{experiment}/models", {"model": model, "add": add or []})

    def add_effect(self, experiment: str, effect: str, joint: str | None = None) -> Json:
        """Add an effect to the current model (a job)."""
        return self._post(f"/experiments/{experiment}/models/effects", {"effect": effect, "joint": joint})

    def remove_effect(self, experiment: str, effect: str, joint: str | None = None) -> Json:
        """Remove an effect from the current model (a job)."""
        change = {"effect": effect, "joint": joint}
        return self._post(f"/experiments/{experiment}/models/effects/remove", change)

    def undo(self, experiment: str) -> Json:
        """Go back to the model before."""
        return self._post(f"/experiments/{experiment}/models/undo")

    def redo(self, experiment: str) -> Json:
        """Take back the last undo."""
        return self._post(f"/experiments/{experiment}/models/redo")

    def diagnose(self, experiment: str, model: str, motion: bool = False) -> Json:
        """Find what a model version misses (a job); with `motion`, also what that does to motion predicted a second ahead."""
        asked = "?motion=true" if motion else ""
        return self._post(f"/experiments/{experiment}/models/{model}/diagnosis{asked}")

    def diagnosis(self, experiment: str, model: str) -> DiagnosisDocument:
        """What was found to be missing in a model version."""
        address = f"/experiments/{experiment}/models/{model}/diagnosis"
        return document_of(DiagnosisDocument, self._get(address), address)

    def find_next_experiment(self, experiment: str, model: str, joint: str) -> Json:
        """Find the experiment that tells apart what the diagnosis left open on a joint (a job)."""
        return self._post(f"/experiments/{experiment}/models/{model}/next-experiment", {"joint": joint})

    def next_experiment(self, experiment: str, model: str, joint: str) -> NextExperimentDocument:
        """The experiment that would tell the rivals of a joint apart."""
        address = f"/experiments/{experiment}/models/{model}/next-experiment"
        return document_of(NextExperimentDocument, self._get(address, joint=joint), address)

    def plan_next_experiment(
        self, experiment: str, model: str, joint: str, proposal: int = 1, rig: str | None = None
    ) -> Json:
        """Plan a proposed experiment; `plan`, `rig` and `payload` are what a session takes."""
        wanted = {"joint": joint, "proposal": proposal, "rig": rig}
        return self._post(f"/experiments/{experiment}/models/{model}/next-experiment/plan", wanted)

    def simulate(self, experiment: str, model: str) -> Json:
        """Run a model version forward along its record (a job)."""
        return self._post(f"/experiments/{experiment}/models/{model}/simulation")

    def simulation(self, experiment: str, model: str) -> SimulationDocument:
        """How well a model version predicts motion."""
        address = f"/experiments/{experiment}/models/{model}/simulation"
        return document_of(SimulationDocument, self._get(address), address)

    def export(self, experiment: str, model: str, ending: str) -> Json:
        """Write a model version for another program: urdf, sdf, xml, py, c, st, fmu or json (a job)."""
        return self._post(f"/experiments/{experiment}/models/{model}/exports/{ending}")

    def certificate(self, experiment: str, model: str, ending: str) -> Certificate:
        """What an exported file keeps of the model, and what that costs."""
        address = f"/experiments/{experiment}/models/{model}/exports/{ending}"
        return document_of(Certificate, self._get(address), address)

    def exported_file(self, experiment: str, model: str, ending: str) -> bytes:
        """The exported file; of C a ZIP archive of source, header and certificate."""
        answer = self._http.get(f"/experiments/{experiment}/models/{model}/exports/{ending}/file")
        if answer.is_error:
            self._answer(answer)
        return answer.content

    def prepare_proof(
        self,
        experiment: str,
        rig: str,
        plan: str,
        payload: str,
        model: str | None = None,
        part: Literal["whole", "friction"] = "whole",
        share: float = 0.6,
    ) -> Json:
        """Compute the torque that is sent ahead of a plan (a job whose result is {"proof": number}); nothing moves."""
        wanted = {"rig": rig, "plan": plan, "payload": payload, "model": model, "part": part, "share": share}
        return self._post(f"/experiments/{experiment}/proofs", wanted)

    def proofs(self, experiment: str) -> list[Json]:
        """All proofs on the drive, the newest first."""
        return self._get(f"/experiments/{experiment}/proofs")

    def proof(self, experiment: str, proof: str) -> Json:
        """One proof: what is sent, its two drives, and which comes next."""
        return self._get(f"/experiments/{experiment}/proofs/{proof}")

    def proof_result(self, experiment: str, proof: str) -> CompensationDocument:
        """What a proof did to the following error.

        Raises ServiceError with status 404 until torque was sent ahead.
        """
        address = f"/experiments/{experiment}/proofs/{proof}"
        result = self._get(address)["result"]
        if result is None:
            raise ServiceError(404, {"detail": f"proof {proof}: no torque was sent ahead yet"})
        return document_of(CompensationDocument, result, address)

    def prepare_drive(self, experiment: str, proof: str, drive: Literal["without", "with"]) -> Json:
        """A session for one of a proof's drives, to be taken through its steps as any other (`step`)."""
        return self._post(f"/experiments/{experiment}/proofs/{proof}/drives/{drive}")

    def improve(self, experiment: str, motion: bool = False) -> Json:
        """Diagnose and add until nothing more is justified (a job); with `motion`, predict motion a second ahead too."""
        asked = "?motion=true" if motion else ""
        return self._post(f"/experiments/{experiment}/improvement{asked}")

    def model_signals(
        self,
        experiment: str,
        model: str,
        session: str,
        joint: int = 1,
        start: float | None = None,
        end: float | None = None,
        points: int = 2000,
    ) -> tuple[NDArray[np.float64], Signals]:
        """Time (M,) s and `measured`, `predicted`, `error` torque, `position`, `velocity`, `load` (M,) of
        a joint.
        """
        address = f"/experiments/{experiment}/models/{model}/signals"
        query = {"session": session, "joint": joint, "from": start, "to": end, "points": points}
        return self._signals(address, query)

    def effects(self) -> list[CatalogueEffect]:
        """The catalogue of physical effects."""
        return [CatalogueEffect.model_validate(entry) for entry in self._get("/effects")]

    # --- jobs

    def job(self, identifier: str) -> Json:
        """A job as it is now."""
        return self._get(f"/jobs/{identifier}")

    def cancel(self, identifier: str) -> Json:
        """Cancel a job."""
        return self._post(f"/jobs/{identifier}/cancel")

    def wait(
        self, job: Json, progress: Callable[[float, str], None] | None = None, pause: float = 0.2
    ) -> Json:
        """Wait for a job's end and return its last state; `progress(fraction, words)` is called on the way.

        Raises JobFailed if it ends otherwise than done.
        """
        for state in self.follow(job, pause):
            job = state
            if progress is not None:
                progress(job["fraction"], job["words"])
        if job["state"] != "done":
            raise JobFailed(job)
        return job

    def follow(self, job: Json, pause: float = 0.2) -> Iterator[Json]:
        """Every state of a job that differs from the one before, asked for every `pause` s; ends with the
        last.
        """
        seen: Json = {}
        while True:
            state = self.job(job["id"])
            if state != seen:
                yield state
            if state["state"] in FINAL:
                return
            seen = state
            clock.sleep(pause)

    # --- rigs, plans, sessions

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

    def recover(self, experiment: str, session: str) -> Json:
        """Close a recording that was cut off; it is identified with the others if there is enough of it."""
        return self._post(f"/experiments/{experiment}/sessions/{session}/recover")

    def admit(self, experiment: str, session: str) -> Json:
        """Use a session that ended early, after a look at it."""
        return self._post(f"/experiments/{experiment}/sessions/{session}/admit")

    def stop(self, rig: str) -> bool:
        """Bring the rig to rest, now; returns whether something was under way.

        By a new connection, to the stop's own port where the service has one: these are answered whatever the service is doing
        (not where the connections are somebody else's, given as `http`).
        """
        address = f"/rigs/{rig}/stop"
        if self._others:
            return self._post(address)["stopped"]
        here, headers = self._http.base_url, self._http.headers
        there = here if self._stop_port is None else here.copy_with(port=int(self._stop_port))
        try:
            with httpx.Client(base_url=there, headers=headers, timeout=STOP_TIMEOUT) as fresh:
                return self._answer(fresh.post(address))["stopped"]
        except (httpx.HTTPError, ServiceError):
            return self._post(address)["stopped"]

    def make_plan(
        self, rig: str, name: str, seconds: float = 60.0, model: str = "load-velocity", seed: int = 0
    ) -> Json:
        """Plan an excitation (a job whose result is {"plan": id})."""
        wanted = {"rig": rig, "name": name, "seconds": seconds, "model": model, "seed": seed}
        return self._post("/plans", wanted)

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

    # --- inside

    def _forget_cookies(self, _answer: httpx.Response) -> None:
        """A cookie would make a browser of us, of which the service wants a token with every change."""
        self._http.cookies.clear()

    def _note_stop_port(self, answer: httpx.Response) -> None:
        self._stop_port = answer.headers.get("Stop-Port", self._stop_port)

    def _get(self, address: str, **query: Any) -> Any:
        return self._answer(self._http.get(address, params=query))

    def _post(self, address: str, body: Json | None = None) -> Any:
        return self._answer(
            self._http.post(address, json=body) if body is not None else self._http.post(address)
        )

    def _signals(self, address: str, query: Json) -> tuple[NDArray[np.float64], Signals]:
        known = {name: value for name, value in query.items() if value is not None}
        answer = self._http.get(address, params=known)
        if answer.is_error:
            self._answer(answer)
        names = answer.headers["X-Columns"].split(",")
        values = np.frombuffer(answer.content, "<f4").reshape(len(names), -1)
        time = values[0].astype(np.float64) + float(answer.headers["X-Time-Origin"])
        return time, dict(zip(names[1:], values[1:], strict=True))

    @staticmethod
    def _answer(answer: httpx.Response) -> Any:
        if not answer.is_error:
            return answer.json() if answer.content else None
        try:
            problem = answer.json()
        except json.JSONDecodeError:
            problem = {"detail": answer.text[:500]}
        raise ServiceError(answer.status_code, problem)


@contextmanager
def _opened(
    files: Sequence[Path | str], field: str = "files"
) -> Iterator[list[tuple[str, tuple[str, IO[bytes]]]]]:
    """Parts of a form, one for each file."""
    with ExitStack() as stack:
        yield [(field, (Path(file).name, stack.enter_context(Path(file).open("rb")))) for file in files]
