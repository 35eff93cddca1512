"""A node's network state and its signs of life: NMT commands, heartbeat, node guarding; each confirmed by the node."""

from collections.abc import Callable

from drivers.as_found import AsFound
from drivers.canopen_network import CanopenNetwork, nmt_state_in_words
from drivers.errors import DriveError
from drivers.node_guarding import ToggleBit, life_time_factor
from drivers.process_data import is_missing, was_refused
from drivers.sdo import SdoAccess
from drivers.state_machine import StateMachine, Timeouts

_GUARD_TIME, _LIFE_TIME_FACTOR = 0x100C, 0x100D
_CONSUMER_HEARTBEAT = 0x1016
_PRODUCER_HEARTBEAT = 0x1017
_SIGN_OF_LIFE = 0x700
NMT_COMMANDS = {"OPERATIONAL": (1, 5), "STOPPED": (2, 4), "PRE-OPERATIONAL": (128, 127)}
"""By name: the command, and the state that a sign of life then shows (CiA 301, sections 7.2.8.3.1 and 7.2.8.3.2)."""
NMT_RESET_NODE = 129
_ASK_AGAIN = 0.05
"""s between two remote frames while a state is waited for"""


class ManagedNode(StateMachine):
    """The network management of one drive.

    network  : the CanopenNetwork it is on
    node     : its CANopen node id
    """

    def __init__(self, network: CanopenNetwork, node: int, sdo: SdoAccess, timeouts: Timeouts):
        super().__init__(node, sdo, network.watch(node), timeouts)
        self.network = network
        self.sign_of_life_period = 0.0
        """s between two signs of life, as the drive confirmed it; 0 while it gives none"""
        self.as_found = AsFound(sdo)
        self.set_up_remarks: list[str] = []
        """What was done otherwise than usual while it was set up, in words."""
        self._boot_ups_expected = 0
        self._was_commanded = False

    @property
    def is_as_found(self) -> bool:
        """Whether nothing was written to it and no command was sent to it: it may be somebody else's."""
        return not (self._was_commanded or self.sdo.has_written)

    def _command_nmt(self, command: int) -> None:
        self._was_commanded = True
        self.network.send(0, bytes((command, self.node)))

    # ---- signs of life ----

    @property
    def guarded(self) -> bool:
        """Whether it is asked for its signs of life by remote frames, for it has no heartbeat of its own."""
        return self.watch.toggle is not None

    def produce_heartbeat(self, period: float) -> None:
        """Let the drive give a sign of life every `period` s (0 ends it): its heartbeat, or answers to `ask_if_alive`.

        A heartbeat time that can only be read is used as it stands. Raises DriveError when the drive gives neither.
        """
        if not self._has(_PRODUCER_HEARTBEAT):
            if period:
                self._begin_guarding()
            self.sign_of_life_period = period
            return
        wanted, what = round(period * 1e3), "setting the heartbeat"
        present = self.sdo.read(_PRODUCER_HEARTBEAT, 0, "uint16", what)
        if present != wanted:
            try:
                self.sdo.write_verified(_PRODUCER_HEARTBEAT, 0, "uint16", wanted, what)
                present = wanted
            except DriveError as refusal:
                if not was_refused(refusal):
                    raise
                if period and not present:  # there is one, but it is off
                    self._begin_guarding()
                    present = wanted
        self.sign_of_life_period = present * 1e-3

    def _begin_guarding(self) -> None:
        """Two answers with different toggle bits are what a node that lives can do."""
        toggle = self.watch.toggle = ToggleBit()
        for _ in range(2):
            before = self.watch.signs_of_life
            if not self._asked_until(lambda before=before: self.watch.signs_of_life > before):
                received = (
                    "its answers have always the same toggle bit (bit 7), as those of a controller without a processor"
                    if toggle.repeated
                    else "none came"
                )
                raise DriveError(
                    self.node,
                    "asking for a sign of life, for it has no heartbeat (0x1017)",
                    expected=f"answers to remote frames 0x{_SIGN_OF_LIFE + self.node:03X} (node guarding)",
                    received=received,
                )

    def _asked_until(self, condition: Callable[[], bool]) -> bool:
        """Ask for signs of life until a condition holds; False after the time-out of network management."""
        for _ in range(max(1, round(self.timeouts.nmt / _ASK_AGAIN))):
            self.ask_if_alive()
            if self.watch.wait_for(condition, _ASK_AGAIN):
                return True
        return False

    def ask_if_alive(self) -> None:
        """Send the remote frame of node guarding to a drive that has no heartbeat; nothing to any other.

        Raises BusError when the bus refuses.
        """
        if self.guarded:
            self.network.ask(_SIGN_OF_LIFE + self.node)

    @property
    def misses_master_by(self) -> str:
        """By which of our signs of life the drive notices that we are gone: `heartbeat`, `guarding`, or nothing ("").

        Raises DriveError when the drive does not answer.
        """
        if self._has(_CONSUMER_HEARTBEAT):
            return "heartbeat"
        return "guarding" if self.guarded and self._has(_GUARD_TIME) and self._has(_LIFE_TIME_FACTOR) else ""

    def watch_master(self, master: int, timeout: float) -> None:
        """Let the drive stop by itself when node `master`, which is we, fails for `timeout` s.

        By our heartbeat, or by the remote frames of node guarding. A drive that has neither cannot; that is said by `oddities`,
        and we go on watching its own signs of life.

        Raises DriveError when the drive refuses.
        """
        by = self.misses_master_by
        try:
            self._set_master_watch(by, master, timeout)
        except DriveError as refusal:
            if not was_refused(refusal):
                raise
            self.set_up_remarks.append(
                f"cannot be told to watch us ({refusal.where} can only be read): it may not notice when we are gone"
            )

    def end_master_watch(self) -> None:
        """Give the drive the watch over its master back that it had before `watch_master`.

        Raises DriveError when the drive does not answer.
        """
        self.as_found.put_back(only=(_CONSUMER_HEARTBEAT, _GUARD_TIME, _LIFE_TIME_FACTOR))

    def _set_master_watch(self, by: str, master: int, timeout: float) -> None:
        if by == "heartbeat":
            entry = (master & 0x7F) << 16 | round(timeout * 1e3)
            self._hold(_CONSUMER_HEARTBEAT, 1, "uint32", entry, "setting the heartbeat consumer")
        elif by == "guarding":
            period = self.sign_of_life_period
            factor = life_time_factor(period, timeout) if period else 0
            what = "setting the life time of node guarding"
            self._hold(_GUARD_TIME, 0, "uint16", round(period * 1e3) if factor else 0, what)
            self._hold(_LIFE_TIME_FACTOR, 0, "uint8", factor, what)

    # ---- network state ----

    def set_nmt_state(self, name: str) -> None:
        """OPERATIONAL, PRE-OPERATIONAL or STOPPED, confirmed by the drive's next sign of life.

        Raises DriveError when none shows that state in time.
        """
        command, wanted = NMT_COMMANDS[name]
        # A heartbeat that was on its way before the command says nothing about it.
        self.watch.nmt_state = None
        self._command_nmt(command)

        def reached() -> bool:
            return self.watch.nmt_state == wanted

        patience = max(self.timeouts.nmt, 1.5 * self.sign_of_life_period)
        shown = self._asked_until(reached) if self.guarded else self.watch.wait_for(reached, patience)
        if not shown:
            seen = self.watch.nmt_state
            sign = "an answer to node guarding" if self.guarded else "a heartbeat"
            raise DriveError(
                self.node,
                f"NMT command to {name}",
                expected=f"{sign} with {name} within {patience:g} s",
                received="none came" if seen is None else f"it says {nmt_state_in_words(seen)}",
            )

    def reset_node(self) -> None:
        """NMT reset, confirmed by the boot-up.

        Raises DriveError when no boot-up comes in time.
        """
        before = self.watch.boot_ups
        self._boot_ups_expected = before + 1
        self._command_nmt(NMT_RESET_NODE)
        if not self.watch.wait_for(lambda: self.watch.boot_ups > before, self.timeouts.boot):
            raise DriveError(
                self.node,
                "NMT reset",
                expected=f"boot-up within {self.timeouts.boot:g} s",
                received="none came",
            )

    def reset_at_once(self) -> None:
        """NMT stop and reset, without waiting: a drive boots without power. Raises BusError when the bus refuses."""
        self._boot_ups_expected = self.watch.boot_ups + 1
        self._command_nmt(NMT_COMMANDS["STOPPED"][0])
        self._command_nmt(NMT_RESET_NODE)

    def expect_no_restart(self) -> None:
        """From now on a boot-up that nobody asked for is a restart."""
        self._boot_ups_expected = self.watch.boot_ups

    @property
    def restarted(self) -> bool:
        """Whether the drive has booted by itself since `expect_no_restart`: it lost its supply, or reset itself."""
        return self.watch.boot_ups > self._boot_ups_expected

    # ---- objects that may not be there, or not be written ----

    def _has(self, index: int, subindex: int = 0) -> bool:
        """Whether the drive has an object. Raises DriveError when it does not answer."""
        try:
            self.sdo.read_bytes(index, subindex)
        except DriveError as refusal:
            if is_missing(refusal):
                return False
            raise
        return True

    def _hold(self, index: int, subindex: int, kind: str, value: int, what: str) -> None:
        """Write an object unless it holds the value already, so that one that cannot be written is no obstacle then.

        Raises DriveError when the drive refuses or something else is read back.
        """
        if self.sdo.read(index, subindex, kind, what) != value:
            self.sdo.write_verified(index, subindex, kind, value, what)
