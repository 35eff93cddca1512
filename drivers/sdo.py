"""Reading and writing objects of a node by SDO, with stated time-outs, retries and reasons in words."""

import contextlib
import queue
import struct
import threading
import time
from collections.abc import Callable, Generator
from typing import Any

import can
import canopen
from canopen.sdo.constants import ABORT_OUT_OF_MEMORY, ABORT_TIMED_OUT, RESPONSE_ABORTED
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.errors import BusError, DriveError, reason_in_words

_FORMATS = {
    "int8": "<b",
    "int16": "<h",
    "int32": "<i",
    "uint8": "<B",
    "uint16": "<H",
    "uint32": "<I",
    "float32": "<f",
}


_ANSWER_TO = {0x20: 0x60, 0x40: 0x40, 0x00: 0x20, 0x60: 0x00}
"""Command specifier of the server's answer to that of the client's request (CiA 301, 7.2.4.3): initiate download and
upload, download and upload of a segment."""
_INITIATES = (0x20, 0x40)
_UPLOAD_SEGMENT = 0x60
MOST_SEGMENTS = 10_000
"""of one upload, seven bytes each: what is longer is no object of a drive, but a node whose last segment never comes"""


_SECOND_ANSWER = 0.02
"""s that a second node may answer after the first: some times what drives take to answer an SDO"""


def _answers(request: bytes, response: bytes) -> bool:
    """Whether a response is to this request: its kind, and for one that initiates a transfer index and subindex."""
    asked = request[0] & 0xE0
    if len(response) < 8 or (asked in _INITIATES and response[1:4] != request[1:4]):
        return False
    return response[0] == RESPONSE_ABORTED or response[0] & 0xE0 == _ANSWER_TO.get(asked)


class SdoAccess:
    """SDO of one node; safe to use from several threads.

    node    : CANopen node id
    remote  : that node of a CanopenNetwork
    timeout : s to wait for each answer
    retries : how often a request without answer is sent again
    """

    def __init__(self, node: int, remote: canopen.RemoteNode, timeout: float = 0.3, retries: int = 2):
        self.node = node
        self.timeout = timeout
        self.retries = retries
        self._client = remote.sdo
        # canopen takes the next answer for its own, whatever was asked: an answer that came after its time-out, and was
        # asked for twice, would be read as that to the next question.
        vars(self._client)["request_response"] = self._ask
        self._lock = threading.RLock()
        self._segments = 0
        self.has_written = False
        """whether any object of the node was to be written, whatever became of it"""
        self.about_to_write: Callable[[int, int], None] | None = None
        """told index and subindex of an object before it is written, unless it is written to stay"""
        self._to_stay = False

    @contextlib.contextmanager
    def hurried(self, timeout: float, retries: int = 0) -> Generator[None]:
        """Ask with another patience within: where a drive must be stopped, nobody waits for one that is gone."""
        with self._lock:
            before = self.timeout, self.retries
            self.timeout, self.retries = timeout, retries
            try:
                yield
            finally:
                self.timeout, self.retries = before

    @contextlib.contextmanager
    def lasting(self) -> Generator[None]:
        """What is written within is to stay when the bus is left."""
        with self._lock:
            self._to_stay = True
            try:
                yield
            finally:
                self._to_stay = False

    def _ask(self, request: bytes) -> bytes:
        """Send a request and wait for the answer to it; answers to what was asked earlier are passed over.

        Raises SdoAbortedError when the node refuses, SdoCommunicationError when it does not answer.
        """
        client = self._client
        self._segments = self._segments + 1 if request[0] & 0xE0 == _UPLOAD_SEGMENT else 0
        if self._segments > MOST_SEGMENTS:
            client.abort(ABORT_OUT_OF_MEMORY)
            raise SdoCommunicationError(f"The answer does not end after {MOST_SEGMENTS} segments")
        responses: queue.Queue[bytes] = queue.Queue()
        client.responses = responses
        for _ in range(1 + self.retries):
            client.send_request(request)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
            end = time.monotonic() + self.timeout
            while (left := end - time.monotonic()) > 0:
                try:
                    response = responses.get(timeout=left)
                except queue.Empty:
                    break
                if _answers(bytes(request), response):
                    if response[0] == RESPONSE_ABORTED:
                        raise SdoAbortedError(int.from_bytes(response[4:8], "little"))
                    return response
        client.abort(ABORT_TIMED_OUT)
        raise SdoCommunicationError("No SDO response received")

    def answered_twice(self) -> bool:
        """Whether more than one node answers under this id: 0x1000 is asked for three times, and twice two answers come.

        Once would not do: a controller that missed an acknowledgement sends its frame again.
        """
        request = bytes((0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0))
        twice = 0
        with self._lock:
            for _ in range(3):
                responses: queue.Queue[bytes] = queue.Queue()
                self._client.responses = responses
                self._client.send_request(request)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
                answers = 0
                patience = self.timeout
                while answers < 2:
                    try:
                        response = responses.get(timeout=patience)
                    except queue.Empty:
                        break
                    answers += _answers(request, response)
                    patience = _SECOND_ANSWER
                twice += answers == 2
        return twice >= 2

    def read(self, index: int, subindex: int, kind: str, what: str = "") -> Any:
        """The value of an object; kind is int8 … uint32, float32.

        Raises DriveError when the node does not answer, refuses, or answers with another length.
        """
        data = self.read_bytes(index, subindex, what)
        form = _FORMATS[kind]
        if len(data) < struct.calcsize(form):
            raise DriveError(
                self.node,
                what or "reading an object",
                index=index,
                subindex=subindex,
                expected=f"{struct.calcsize(form)} bytes ({kind})",
                received=f"{len(data)} came",
            )
        return struct.unpack_from(form, data)[0]

    def read_bytes(self, index: int, subindex: int, what: str = "") -> bytes:
        """The bytes of an object.

        Raises DriveError when the node does not answer or refuses.
        """
        with self._lock:
            try:
                return self._client.upload(index, subindex)
            except (SdoAbortedError, SdoCommunicationError, can.CanError, OSError) as error:
                raise self._in_words(error, what or "reading an object", index, subindex) from error

    def write(self, index: int, subindex: int, kind: str, value: float, what: str = "") -> None:
        """Write an object; kind is int8 … uint32, float32.

        Raises DriveError when the node does not answer or refuses, ValueError when the value does not fit.
        """
        try:
            data = struct.pack(_FORMATS[kind], value)
        except struct.error as error:
            raise ValueError(f"{value} does not fit object 0x{index:04X}:{subindex:02X} ({kind})") from error
        self.write_bytes(index, subindex, data, what or f"writing {value}")

    def write_bytes(self, index: int, subindex: int, data: bytes, what: str = "") -> None:
        """Write the bytes of an object.

        Raises DriveError when the node does not answer or refuses.
        """
        self.has_written = True
        with self._lock:
            if self.about_to_write is not None and not self._to_stay:
                self.about_to_write(index, subindex)
            try:
                self._client.download(index, subindex, data)
            except (SdoAbortedError, SdoCommunicationError, can.CanError, OSError) as error:
                raise self._in_words(error, what or "writing an object", index, subindex) from error

    def write_verified(self, index: int, subindex: int, kind: str, value: float, what: str = "") -> None:
        """Write an object and read it back.

        Raises DriveError also when something else is read back.
        """
        self.write(index, subindex, kind, value, what)
        stored = self.read(index, subindex, kind, what)
        if stored != value:
            as_text = "0x{:X}".format if kind.startswith("uint") else str
            raise DriveError(
                self.node,
                what or "writing an object",
                index=index,
                subindex=subindex,
                expected=f"{as_text(value)} to be read back",
                received=f"{as_text(stored)} came",
            )

    def _in_words(self, error: Exception, doing: str, index: int, subindex: int) -> Exception:
        if isinstance(error, SdoAbortedError):
            reason = SdoAbortedError.CODES.get(error.code, "a code that CiA 301 does not define")
            received = f"the drive refused: {reason} (abort code 0x{error.code:08X})"
        elif isinstance(error, SdoCommunicationError):
            received = f"no answer within {self.timeout:g} s, asked {1 + self.retries} times"
            if "No SDO response" not in str(error):
                received = f"the SDO transfer broke: {error}"
        else:
            return BusError(f"node {self.node}: {doing}: {reason_in_words(error)}")
        return DriveError(self.node, doing, index=index, subindex=subindex, received=received)
