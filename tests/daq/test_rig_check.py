"""What is found wrong with a rig before a session, joint by joint, on simulated drives."""

import re
from dataclasses import asdict
from importlib.resources import files
from types import SimpleNamespace

import pytest

from daq import rig_check
from daq.rig_check import CheckItem, RigCheck, check_rig
from daq.rig_drives import RigDrives
from drivers.simulated import process_image as slot
from tests.daq.rig_variants import with_limits


def checked(rig) -> RigCheck:
    drives = RigDrives(rig)
    try:
        return check_rig(drives)
    finally:
        drives.close()


def test_a_rig_that_is_as_its_file_says_is_ready(still_rig, powered):
    check = checked(still_rig)
    assert check.ok
    assert check.problems == ""
    said = "; ".join(item.words for item in check.items)
    assert "device profile 402" in said
    assert "rated 2.22 N m" in said
    assert asdict(check.items[-1]) == {
        "what": "joint j3",
        "ok": True,
        "words": "is at 0",
        "advice": False,
    }


def test_a_rated_torque_that_differs_by_more_than_a_rounding_is_a_problem(still_rig, powered):
    (axis,) = still_rig.axes
    for factor, agrees in ((1.009, True), (0.991, True), (1.012, False), (0.988, False)):
        believed = axis.model_copy(update={"rated_torque": axis.rated_torque / factor})
        check = checked(still_rig.model_copy(update={"axes": (believed,)}))
        assert check.ok == agrees, factor
        assert agrees or "one of them is wrong" in check.problems


@pytest.mark.parametrize(("beyond", "ok"), [(-0.001, True), (0.001, False)])
def test_a_position_may_lie_outside_its_limits_by_the_following_error_and_no_more(
    still_rig, powered, beyond, ok
):
    slack = still_rig.axes[0].limits.following_error
    above = with_limits(still_rig, position=(-1.0, -slack - beyond))
    below = with_limits(still_rig, position=(slack + beyond, 1.0))
    for narrow in (above, below):
        check = checked(narrow)
        assert check.ok is ok
        assert ok or "is at 0, outside its limits" in check.problems


def test_an_axis_that_moves_without_power_is_waited_for(still_rig, powered):
    drive = powered.nodes[0].drive
    get_data = powered.nodes[0].get_data

    def passing(index, subindex, check_readable=False):
        if index == 0x6064:
            drive.image[slot.POSITION] += 200_000
        return get_data(index, subindex, check_readable)

    powered.nodes[0].get_data = passing
    assert "moves although it has no power" in checked(still_rig).problems


@pytest.mark.parametrize(("share", "moves"), [(0.009, False), (-0.009, False), (0.011, True), (-0.011, True)])
def test_an_axis_stands_below_a_hundredth_of_its_velocity_limit(rig, monkeypatch, share, moves):
    (axis,) = rig.axes
    speed = share * axis.limits.velocity / rig.position_matrix[0, 0]  # counts/s
    now = [100.0]

    def sleep(seconds):
        now[0] += seconds

    monkeypatch.setattr(rig_check, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=sleep))
    drive = SimpleNamespace(position=lambda: round(speed * (now[0] - 100.0)))
    assert rig_check._moves(rig, drive, axis) is moves


def test_problems_are_what_is_not_ok_each_with_what_it_concerns():
    check = RigCheck(
        (CheckItem("bus", True, "quiet"), CheckItem("joint a", False, "x"), CheckItem("joint b", False, "y"))
    )
    assert not check.ok
    assert check.problems == "joint a: x; joint b: y"


def test_what_set_up_will_write_is_said_by_the_check_by_the_eds_of_the_drive(still_rig, powered, tmp_path):
    eds = tmp_path / "mine.eds"
    listed = (files("config") / "drives" / "simulated.eds").read_text(encoding="utf-8")
    eds.write_text(re.sub(r"(?is)(\[1800sub1\].*?AccessType=)rw", r"\1ro", listed, count=1), encoding="utf-8")
    (axis,) = still_rig.axes
    named = axis.model_copy(update={"drive": str(eds)})
    powered.nodes[0].set_data(0x1800, 1, (0x1A5).to_bytes(4, "little"))
    words = [item.words for item in checked(still_rig.model_copy(update={"axes": (named,)})).items]
    assert any("COB-ID 0x1A5 to 0x183" in each for each in words)
    assert "by mine.eds, 0x1800:01 can only be read: it goes on with 0x1A5" in words
