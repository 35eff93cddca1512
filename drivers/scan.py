"""Who is on the bus: every node id is asked for its identity, and heartbeats are listened to meanwhile."""

import time
from dataclasses import dataclass

from drivers.bus import BusSettings
from drivers.bus_claim import BusClaim
from drivers.canopen_network import CanopenNetwork, nmt_state_in_words
from drivers.cia402 import STATUSWORD, state_of

_SDO_REQUEST, _SDO_ANSWER = 0x600, 0x580
_UPLOAD = 0x40  # SDO command: initiate upload
_ABORT = 0x80
# Four requests of 8 bytes and their answers take about a millisecond at 1 Mbit/s.
_PAUSE = 0.0005  # s between requests, so that no transmit queue overflows

# What is asked, in this order: index, subindex.
_QUESTIONS = ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3), (0x1018, 4), (STATUSWORD, 0))


@dataclass(frozen=True)
class FoundNode:
    """A node that answered or was heard.

    Numbers are None where the node did not say them.

    profile    : lower half of 0x1000; 402 for a drive
    nmt_state  : from its heartbeat, in words; None without one
    state      : CiA 402 state, in words; None for what is not a drive
    """

    node: int
    device_type: int | None
    vendor: int | None
    product: int | None
    revision: int | None
    serial: int | None
    nmt_state: str | None
    state: str | None

    @property
    def profile(self) -> int | None:
        """Device profile number."""
        return None if self.device_type is None else self.device_type & 0xFFFF


class _Listener:
    """Answers and heartbeats as they come; on the network's thread."""

    def __init__(self) -> None:
        self.answers: dict[tuple[int, int, int], int | None] = {}
        self.heartbeats: dict[int, int] = {}

    def on_answer(self, can_id: int, data: bytearray, timestamp: float) -> None:
        if len(data) < 8:
            return
        key = (can_id - _SDO_ANSWER, int.from_bytes(data[1:3], "little"), data[3])
        command = data[0]
        if command == _ABORT:
            self.answers[key] = None
        elif command & 0xE2 == 0x42:  # expedited upload
            size = 4 - (command >> 2 & 3) if command & 1 else 4
            self.answers[key] = int.from_bytes(data[4 : 4 + size], "little")

    def on_heartbeat(self, can_id: int, data: bytearray, timestamp: float) -> None:
        if data:
            self.heartbeats[can_id & 0x7F] = data[0] & 0x7F


def scan(settings: BusSettings, *, wait: float = 0.3, nodes: range = range(1, 128)) -> list[FoundNode]:
    """The nodes on a bus, by node id.

    The bus is only read: nothing is started, stopped or written.

    wait  : s to wait for answers after the last question
    nodes : the node ids to ask

    Raises BusInUse while a session, homing or another scan has the bus, BusError when it cannot be opened.
    """
    listener = _Listener()
    with BusClaim(settings, "a scan"), CanopenNetwork(settings) as network:
        for node in nodes:
            network.subscribe(_SDO_ANSWER + node, listener.on_answer)
            network.subscribe(0x700 + node, listener.on_heartbeat)
        # One question at a time to a node: an SDO server answers one transfer.
        present = list(nodes)
        for index, subindex in _QUESTIONS:
            _ask(network, present, index, subindex)
            _await_answers(listener, present, index, subindex, wait)
            if index == 0x1000:
                answered = {node for node, *_ in listener.answers}
                present = [node for node in nodes if node in answered]
        heard = sorted({node for node, *_ in listener.answers} | set(listener.heartbeats))
    return [_found(node, listener) for node in heard]


def _ask(network: CanopenNetwork, nodes: list[int], index: int, subindex: int) -> None:
    question = bytes((_UPLOAD, index & 0xFF, index >> 8, subindex, 0, 0, 0, 0))
    for node in nodes:
        network.send(_SDO_REQUEST + node, question)
        time.sleep(_PAUSE)


def _await_answers(listener: _Listener, nodes: list[int], index: int, subindex: int, wait: float) -> None:
    end = time.monotonic() + wait
    while time.monotonic() < end:
        if all((node, index, subindex) in listener.answers for node in nodes):
            return
        time.sleep(0.005)


def _found(node: int, listener: _Listener) -> FoundNode:
    values = [listener.answers.get((node, index, subindex)) for index, subindex in _QUESTIONS]
    device_type, vendor, product, revision, serial, statusword = values
    state = None
    if statusword is not None and device_type is not None and device_type & 0xFFFF == 402:
        try:
            state = state_of(statusword).words
        except ValueError as unknown:
            state = str(unknown)
    heartbeat = listener.heartbeats.get(node)
    nmt_state = None if heartbeat is None else nmt_state_in_words(heartbeat)
    return FoundNode(node, device_type, vendor, product, revision, serial, nmt_state, state)
