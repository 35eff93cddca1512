"""A drive without a heartbeat is asked for its signs of life by remote frames, and misses us by them."""

import pytest

from drivers.drive import Drive, Timeouts
from drivers.errors import DriveError
from drivers.network_management import NMT_COMMANDS, NMT_RESET_NODE
from drivers.simulated.oddities import OdditySettings

HEARTBEAT_FAULT = (0x2010, 3)
QUICK = Timeouts(sdo=0.2, retries=1, nmt=0.2)


@pytest.fixture
def guarded(open_bench, axis):
    return open_bench(axis(oddities=OdditySettings(node_guarding_only=True)))


def test_its_network_state_is_confirmed_by_answers_whose_toggle_bit_changes(guarded):
    drive = guarded.drive
    drive.produce_heartbeat(0.05)
    for name in ("PRE-OPERATIONAL", "OPERATIONAL", "PRE-OPERATIONAL"):
        drive.set_nmt_state(name)
    assert drive.guarded
    assert drive.watch.toggle.repeated == 0
    (said,) = [each for each in drive.oddities() if "0x1017" in each]
    assert "remote frames (node guarding), and notices by them when we are gone" in said


def test_a_node_that_falls_silent_shows_no_state(guarded):
    drive = Drive(guarded.network, 5, timeouts=QUICK)
    drive.produce_heartbeat(0.05)
    last = drive.watch.last_heard
    drive.sdo.write(*HEARTBEAT_FAULT, "int32", 0)
    with pytest.raises(
        DriveError, match=r"an answer to node guarding with OPERATIONAL within 0\.2 s; none came"
    ):
        drive.set_nmt_state("OPERATIONAL")
    assert drive.watch.last_heard == last


def test_answers_of_a_controller_whose_processor_is_dead_are_no_sign_of_life(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(node_guarding_only=True, toggles=False)))
    with pytest.raises(DriveError, match=r"remote frames 0x705 .*always the same toggle bit"):
        Drive(bench.network, 5, timeouts=QUICK).produce_heartbeat(0.05)


def test_a_node_that_is_never_asked_again_stops_by_itself(guarded):
    guarded.bring_up()
    drive = guarded.drive
    drive.watch_master(127, 0.2)
    assert (drive.sdo.read(0x100C, 0, "uint16"), drive.sdo.read(0x100D, 0, "uint8")) == (50, 4)
    drive.ask_if_alive()
    assert drive.watch.wait_for(lambda: any(each.code == 0x8130 for each in drive.emergencies), 10.0)
    drive.end_master_watch()
    assert drive.sdo.read(0x100C, 0, "uint16") == 0
    assert drive.sdo.read(0x100D, 0, "uint8") == 0


def test_a_heartbeat_time_that_can_only_be_read_is_used_as_it_stands(open_bench, axis):
    fixed = OdditySettings(read_only=("0x1017",), holds={"0x1017": 40})
    bench = open_bench(axis(oddities=fixed))
    bench.drive.produce_heartbeat(0.1)
    assert bench.drive.sign_of_life_period == 0.04
    bench.drive.set_nmt_state("OPERATIONAL")


def test_commands_and_states_have_the_numbers_of_cia_301():
    """Tables 35 and 45 of CiA 301 (start 1, stop 2, pre-operational 128, reset 129; 4, 5 and 127), as python-canopen has them."""
    from canopen.nmt import COMMAND_TO_STATE, NMT_STATES

    assert {command: name for name, (command, _) in NMT_COMMANDS.items()} == {
        command: NMT_STATES[COMMAND_TO_STATE[command]] for command in (1, 2, 128)
    }
    assert all(NMT_STATES[shown] == name for name, (_, shown) in NMT_COMMANDS.items())
    assert NMT_RESET_NODE == 129
