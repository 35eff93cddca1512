"""What every call goes through: one service's connections, its answers, and its refusals as exceptions."""

import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self, TypeVar

import httpx
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from api.service.job_documents import JobView
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.results.document import Json

View = TypeVar("View", bound=BaseModel)
Signals = dict[str, NDArray[np.float32]]
STOP_TIMEOUT = 2.0
"""s for the answer to a stop"""


def view_of(kind: type[View], values: object, address: str) -> View:
    """The document that an answer is; what it holds beyond that, as of a newer service, is left out.

    Raises InputError where it is no such document, as of a service of another version: names address and field.
    """
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{address}: not a {kind.__name__} of this version: {first_fault(error)}") from None


class ServiceError(Exception):
    """The service refused: `status` as in HTTP, `problem` the RFC 9457 document, the text its detail."""

    def __init__(self, status: int, problem: Json) -> None:
        super().__init__(problem.get("detail") or problem.get("title") or f"status {status}")
        self.status = status
        self.problem = problem


class Connection:
    """Asks one service, with one token.

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

    def _forget_cookies(self, _answer: httpx.Response) -> None:
        """A cookie would make a browser of us, of which the service wants a token with every change."""
        self._http.cookies.clear()

    def _note_stop_port(self, answer: httpx.Response) -> None:
        self._stop_port = answer.headers.get("Stop-Port", self._stop_port)

    def _get(self, address: str, **query: Any) -> Any:
        return self._answer(self._http.get(address, params=query))

    def _one(self, kind: type[View], address: str, **query: Any) -> View:
        """What a GET answers, as its document."""
        return view_of(kind, self._get(address, **query), address)

    def _all(self, kind: type[View], address: str, **query: Any) -> list[View]:
        """What a GET answers, as documents."""
        return [view_of(kind, each, address) for each in self._get(address, **query)]

    def _done(self, kind: type[View], address: str, body: Json | None = None) -> View:
        """What a POST answers, as its document."""
        return view_of(kind, self._post(address, body), address)

    def _post(self, address: str, body: Json | None = None) -> Any:
        return self._answer(
            self._http.post(address, json=body) if body is not None else self._http.post(address)
        )

    def _sent(self, kind: type[View], answer: httpx.Response) -> View:
        """What files that were sent became, as its document."""
        return view_of(kind, self._answer(answer), str(answer.url))

    def _begin(self, address: str, body: Json | None = None) -> JobView:
        """Post what begins a job; the job."""
        return self._done(JobView, address, body)

    def _post_at_once(self, address: str) -> Any:
        """Post by a new connection, to the stop's own port where the service has one.

        These are answered whatever the service is doing (not where the connections are somebody else's, given as `http`).
        """
        if self._others:
            return self._post(address)
        here, headers = self._http.base_url, self._http.headers
        there = here if self._stop_port is None else here.copy_with(port=int(self._stop_port))
        try:
            with httpx.Client(base_url=there, headers=headers, timeout=STOP_TIMEOUT) as fresh:
                return self._answer(fresh.post(address))
        except (httpx.HTTPError, ServiceError):
            return self._post(address)

    def _signals(self, address: str, query: Json) -> tuple[NDArray[np.float64], Signals]:
        known = {name: value for name, value in query.items() if value is not None}
        answer = self._http.get(address, params=known)
        names = self._checked(answer).headers["X-Columns"].split(",")
        values = np.frombuffer(answer.content, "<f4").reshape(len(names), -1)
        time = values[0].astype(np.float64) + float(answer.headers["X-Time-Origin"])
        return time, dict(zip(names[1:], values[1:], strict=True))

    def _answer(self, answer: httpx.Response) -> Any:
        return self._checked(answer).json() if answer.content else None

    @staticmethod
    def _checked(answer: httpx.Response) -> httpx.Response:
        """The answer itself. Raises ServiceError where it is none but an error; one that comes as a stream is read first."""
        if not answer.is_error:
            return answer
        answer.read()
        try:
            problem = answer.json()
        except json.JSONDecodeError:
            problem = {"detail": answer.text[:500]}
        raise ServiceError(answer.status_code, problem)


@contextmanager
def opened(
    files: Sequence[Path | str], field: str = "files"
) -> Iterator[list[tuple[str, tuple[str, IO[bytes]]]]]:
    """Parts of a form, one for each file."""
    with ExitStack() as stack:
        yield [(field, (Path(file).name, stack.enter_context(Path(file).open("rb")))) for file in files]
