"""The state machine of a CiA 402 drive, seen from inside the drive: all states, all transitions."""

from drivers import cia402
from drivers.cia402 import Command, State, Transition

# What a quick stop ends in, by object 0x605A: the drive switches itself off, or stays in QUICK STOP ACTIVE.
_QUICK_STOP_STAYS = (5, 6, 7, 8)

POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)


class Cia402Machine:
    """States and transitions of one drive.

    The drive calls `take_controlword` when a controlword arrives, `fail` on a fault, `stopped` when a quick
    stop or fault reaction has brought the axis to rest. `last_transition` tells what happened last.
    """

    def __init__(self) -> None:
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.last_transition: Transition | None = None
        self.quick_stop_option = 2
        self.fault_reaction_option = 2
        self._controlword = 0

    def start(self) -> None:
        """Transitions 0 and 1: self-test done."""
        self._enter(Transition.START, State.NOT_READY_TO_SWITCH_ON)
        self._enter(Transition.INITIALISED, State.SWITCH_ON_DISABLED)

    @property
    def powered(self) -> bool:
        """Whether the motor gets current."""
        return self.state in POWERED

    @property
    def enabled(self) -> bool:
        """Whether the drive follows setpoints."""
        return self.state is State.OPERATION_ENABLED

    @property
    def stopping(self) -> bool:
        """Whether the drive brakes on its own ramp."""
        return self.state in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)

    def take_controlword(self, controlword: int) -> None:
        """Make the transition that a controlword asks for, if the present state has it."""
        command = cia402.command_of(controlword, self._controlword)
        self._controlword = controlword
        if command is not None:
            self.obey(command)

    def obey(self, command: Command) -> None:
        """Make the transition of a command, whoever gives it, if the present state has it."""
        if command is Command.ENABLE_OPERATION and self.state is State.READY_TO_SWITCH_ON:
            # "Enable operation" contains "switch on": the drive goes through SWITCHED ON by itself.
            self._enter(Transition.SWITCH_ON, State.SWITCHED_ON)
        made = cia402.TRANSITIONS.get((self.state, command))
        if made is None:
            return
        if made[0] is Transition.ENABLE_OPERATION_FROM_QUICK_STOP and not self._stays_after_quick_stop:
            return
        self._enter(*made)

    @property
    def _stays_after_quick_stop(self) -> bool:
        return self.quick_stop_option in _QUICK_STOP_STAYS

    def fail(self) -> None:
        """Transition 13, and 14 at once where there is nothing to bring to rest."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        was_powered = self.powered
        self._enter(Transition.FAULT_REACTION, State.FAULT_REACTION_ACTIVE)
        if not was_powered or self.fault_reaction_option == 0:
            self._enter(Transition.FAULT, State.FAULT)

    def stopped(self) -> None:
        """The axis is at rest: end a fault reaction, and a quick stop that does not stay."""
        if self.state is State.FAULT_REACTION_ACTIVE:
            self._enter(Transition.FAULT, State.FAULT)
        elif self.state is State.QUICK_STOP_ACTIVE and not self._stays_after_quick_stop:
            self._enter(Transition.DISABLE_VOLTAGE_FROM_QUICK_STOP, State.SWITCH_ON_DISABLED)

    def _enter(self, transition: Transition, state: State) -> None:
        self.last_transition = transition
        self.state = state
