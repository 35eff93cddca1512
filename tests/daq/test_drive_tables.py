"""Objects of drives' own tables: all written and read back, or as before; what is not as before is said."""

from __future__ import annotations

import pytest

from daq.drive_tables import ObjectWrite, write_tables
from daq.rig import Rig
from daq.simulated_rig import simulated_rig
from drivers.bus import BusSettings
from drivers.errors import DriverError

WRITES = [ObjectWrite(0x2021, place, "int32", 100 * place) for place in range(1, 5)]
"""the first points of the simulated drive's friction table"""


@pytest.fixture
def rig():
    known = Rig.load("rx130l-joint3-simulated")
    return known.model_copy(
        update={
            "axes": (known.axes[0].model_copy(update={"drive": "simulated"}),),
            "bus": BusSettings(interface="virtual", channel="drive-tables-written"),
        }
    )


def test_what_was_held_is_told_before_anything_changes_and_all_is_read_back(rig):
    with simulated_rig(rig, rig.payload("none")) as on:
        held = on.nodes[0].drive.compensation.raw[0x2021]
        told = []
        before = write_tables(rig, [WRITES], lambda values: told.append((values, list(held[:4]))))
        assert told == [(before, [0, 0, 0, 0])]
        assert before == [[0.0] * 4]
        assert list(held[:4]) == [100, 200, 300, 400]


def test_an_object_that_is_refused_leaves_all_as_they_were(rig):
    with simulated_rig(rig, rig.payload("none")) as on:
        held = on.nodes[0].drive.compensation.raw[0x2021]
        beyond = ObjectWrite(0x2021, 250, "int32", 1)  # the table has fewer points
        with pytest.raises(DriverError, match="0x2021"):
            write_tables(rig, [[*WRITES, beyond]])
        assert list(held[:4]) == [0, 0, 0, 0]


def test_a_drive_that_falls_silent_while_it_is_written_to_is_said_to_hold_what_is_half_written(rig):
    """What the drives held before is known before the first object changes, and can be written again once they answer."""
    before = []
    with simulated_rig(rig, rig.payload("none")) as on:
        node = on.nodes[0]
        held, taken = node.drive.compensation.raw[0x2021], node.set_data

        def taken_twice(index, subindex, *rest, **more):
            if (index, subindex) == (0x2021, 3):
                node.faults.frozen = True
            return taken(index, subindex, *rest, **more)

        node.set_data = taken_twice
        with pytest.raises(
            DriverError, match=r"could not be written again: node 3 0x2021:01 to 0x2021:03 \(3 objects\)"
        ):
            write_tables(rig, [WRITES], before.extend)
        assert held[:4] != [0, 0, 0, 0]
    assert before == [[0.0] * 4]
