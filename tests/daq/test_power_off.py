"""What is said to a person of drives that may still have power."""

from __future__ import annotations

from daq.power_off import AxisPower, PowerReport


def axis(joint: str, node: int, off: bool, rests: bool | None, words: str = "it is in FAULT") -> AxisPower:
    return AxisPower(joint, node, off, rests, words)


def test_power_is_off_when_every_drive_says_so_and_nothing_moves():
    report = PowerReport((axis("j1", 1, True, True), axis("j2", 2, True, None)))
    assert report.off
    assert report.alarm == ""


def test_drives_with_power_are_named_with_what_they_said():
    report = PowerReport(
        (
            axis("j1", 1, True, True),
            axis("j2", 2, False, False, "it is in OPERATION ENABLED"),
            axis("j3", 7, False, None, "it does not answer"),
        )
    )
    assert not report.off
    assert report.alarm == (
        "power could not be read back as off (joint j2 (node 2): it is in OPERATION ENABLED; joint j3 (node 7): it does not"
        " answer): press the emergency stop"
    )


def test_joints_that_move_without_power_are_an_alarm_too():
    report = PowerReport((axis("j1", 1, True, False), axis("j2", 2, True, False), axis("j3", 3, False, True)))
    assert report.alarm.endswith(
        "; joint j1, j2 still moves, without power: keep clear, press the emergency stop"
    )
    falling = PowerReport((axis("j1", 1, True, False),))
    assert falling.off
    assert falling.alarm == "joint j1 still moves, without power: keep clear, press the emergency stop"
