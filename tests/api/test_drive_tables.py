"""Friction and cogging in the drives' own tables: written safely, read back; a drive follows better by them."""

from __future__ import annotations

import errno
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import api.drive_tables
import daq.homing
from api.commands.drive_tables import drive_tables as command
from api.drive_tables import cleared_tables, drive_tables, tables_before
from api.drive_tables import written as write_to_drives
from api.drive_tables_text import drive_tables_text
from daq.drive_tables import ObjectWrite, write_tables
from daq.excitation.standard_plan import standard_plan
from daq.following_error import following_error
from daq.plan_setpoints import plan_counts
from daq.rig import RIGS, Rig
from daq.rig_drives import RigDrives
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from daq.simulated_rig import simulated_rig
from drivers.bus import BusSettings
from drivers.cia402 import Command
from drivers.errors import DriveError, DriverError
from drivers.process_data import TORQUE_OFFSET
from drivers.simulated import process_image as slot
from identify.export.exported_model import Torque, exported_model
from identify.identification import identify
from identify.recording import InputError, load_experiment
from identify.results.drive_tables import DriveTablesDocument

NAME = "rx130l-joint3-simulated"


def of_drive(name):
    """RX130L with another profile for its drive, in steps of 2 ms and cycles of 4 ms: half the time."""
    rig = Rig.load(NAME)
    assert rig.simulated is not None
    return rig.model_copy(
        update={
            "axes": (rig.axes[0].model_copy(update={"drive": name}),),
            "cycle": 0.004,
            "simulated": {**rig.simulated, "servo_period": 0.002},
        }
    )


@pytest.fixture(scope="module")
def rig():
    return of_drive("simulated")


def drive(rig, folder, seconds):
    """One session without payload; its recording and the root mean square of its following error."""
    plan = standard_plan(rig, seconds)
    with PayloadSession(rig, folder, plan, rig.payload("none"), "operator", seed=3) as session:
        assert session.check().ok
        session.confirm_payload(0.0)
        session.arm()
        session.start()
        assert session.wait(200.0) is SessionState.DONE
        error = following_error(session.file, plan_counts(rig, plan)).error
    return float(np.sqrt(np.nanmean(error**2)))


@pytest.fixture(scope="module")
def measured(rig, tmp_path_factory):
    """Folder of one session, and its following error."""
    folder = tmp_path_factory.mktemp("tables") / "rx130l"
    return folder, drive(rig, folder, 18.1)


@pytest.fixture(scope="module")
def result(measured):
    return identify(load_experiment(measured[0]), "usual")


@pytest.fixture(scope="module")
def tables(rig, result):
    return drive_tables(result, rig)


def test_a_drive_with_its_table_follows_better_without_any_torque_offset(rig, measured, tables, tmp_path):
    (table,) = tables.joints[0].tables
    assert table.of == "friction"
    assert table.left < 0.2 * table.wanted  # at rest and below the slowest point a line over speed is none
    in_drive = {
        "speeds": [60.0 / (2.0 * np.pi) * point[0] for point in table.points],
        "forward": [point[1] for point in table.points],
        "backward": [point[2] for point in table.points],
        "constant": table.constant,
    }
    simulated = {**rig.simulated, "drives": [{**rig.simulated["drives"][0], "compensation": in_drive}]}
    with_table = drive(rig.model_copy(update={"simulated": simulated}), tmp_path / "with", 18.1)
    assert with_table < 0.9 * measured[1]


def test_tables_are_written_and_read_back_and_the_drive_uses_them(rig, result, tables):
    there = rig.model_copy(update={"bus": BusSettings(interface="virtual", channel="drive-tables")})
    with simulated_rig(there, there.payload("none")) as on:
        written = write_to_drives(drive_tables(result, there), there)
        assert written.written
        (table,) = written.joints[0].tables
        assert [each.before for each in table.objects] == [0.0] * len(table.objects)
        compensation = on.nodes[0].drive.compensation
        for place, (speed, forward, backward) in enumerate(table.points):
            counts = speed / (2.0 * np.pi) * there.axes[0].encoder_counts
            hundredths = 100.0 * 60.0 / (2.0 * np.pi) * speed  # of an rpm
            assert compensation.raw[0x2020][place] == pytest.approx(hundredths, abs=0.51)
            assert compensation.current(counts, 0) == pytest.approx(forward + table.constant, abs=0.02)
            assert compensation.current(-counts, 0) == pytest.approx(backward + table.constant, abs=0.02)
        again = write_to_drives(drive_tables(result, there), there)
        assert all(each.before == each.value for each in again.joints[0].tables[0].objects)
        # without currents, and back to what was before that
        friction, _ = write_to_drives(cleared_tables(there), there).joints[0].tables
        assert friction.objects[0].before == table.objects[8].value
        assert compensation.current(1e5, 0) == 0.0
        back = write_to_drives(tables_before(again, there), there)
        assert [each.before for each in back.joints[0].tables[0].objects][8:] == [0.0] * 17
        assert compensation.current(1e5, 0) != 0.0
        assert "0x2021:01" in drive_tables_text(back)
    with pytest.raises(InputError, match="does not say what the drives held before"):
        tables_before(tables, there)
    with pytest.raises(InputError, match="are of rig"):
        tables_before(again, there.model_copy(update={"name": "another"}))
    for changed in ({"node": 9}, {"drive": "beckhoff-ax2000"}):
        other = there.model_copy(update={"axes": (there.axes[0].model_copy(update=changed),)})
        for attempt in (
            lambda other=other: tables_before(again, other),
            lambda other=other: write_to_drives(again, other),
        ):
            with pytest.raises(
                InputError, match=r"of the drives of j3 \(node 3, simulated\); rig .* has j3"
            ) as refused:
                attempt()
            assert "\n" not in str(refused.value)
    assert not tables.written
    assert "nothing was written" in drive_tables_text(tables)


def test_nothing_is_written_where_what_the_drives_hold_cannot_be_kept(rig):
    there = rig.model_copy(update={"bus": BusSettings(interface="virtual", channel="drive-tables-full")})

    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with simulated_rig(there, there.payload("none")) as on:
        raw = on.nodes[0].drive.compensation.raw
        raw[0x2021][0] = 700
        with pytest.raises(
            InputError, match=r"cannot be kept \(No space left on device\): nothing was written"
        ):
            write_to_drives(cleared_tables(there), there, full)
        assert raw[0x2021][0] == 700


def test_a_rig_with_another_gear_and_the_same_drive_gain_is_refused(rig, result):
    """Twice the ratio at half the torque constant: the same joint torque for a current, at twice the motor's speed."""
    axis = rig.axes[0]
    geared = {"gear_ratio": 2.0 * axis.gear_ratio, "torque_constant": 0.5 * axis.torque_constant}
    other = rig.model_copy(update={"axes": (axis.model_copy(update=geared),)})
    assert other.drive_gain == pytest.approx(rig.drive_gain)
    with pytest.raises(InputError, match=r"j3: its motor_ratio is 95, in rig .* 190; .* another gear"):
        drive_tables(result, other)


def test_tables_are_not_written_once_a_profile_says_something_else_and_what_was_before_is(
    result, tmp_path, monkeypatch
):
    """Between looking at them and saying yes, on the command line."""
    profile = tmp_path / "own.yaml"
    profile.write_text((RIGS.parent / "drives" / "simulated.yaml").read_text())
    rig = of_drive(str(profile))
    there = rig.model_copy(update={"bus": BusSettings(interface="virtual", channel="drive-tables-profile")})
    with simulated_rig(there, there.payload("none")) as on:
        raw = on.nodes[0].drive.compensation.raw
        first = write_to_drives(drive_tables(result, there), there)
        written = {index: list(values) for index, values in raw.items()}
        for tables in (drive_tables(result, there), cleared_tables(there)):
            held = profile.read_text()
            profile.write_text(held.replace("0x2021", "0x2022").replace("index: 0x2020", "index: 0x2021"))
            assert profile.read_text() != held
            with pytest.raises(
                InputError,
                match=r"^rig .*, drive of j3: own\.yaml or .*\.eds changed since .*: nothing was written; compute them again$",
            ):
                write_to_drives(tables, there)
            assert {index: list(values) for index, values in raw.items()} == written
            write_to_drives(tables_before(first, there), there)
            assert not any(raw[0x2021])
            profile.write_text(held)
            write_to_drives(drive_tables(result, there), there)


def test_nothing_is_written_to_a_drive_with_power_and_a_refusal_leaves_all_as_it_was(rig):
    there = rig.model_copy(update={"bus": BusSettings(interface="virtual", channel="drive-tables-refused")})
    first, unknown = ObjectWrite(0x2021, 1, "int32", 700), ObjectWrite(0x2024, 1, "int16", 5)
    with simulated_rig(there, there.payload("none")) as on:
        node = on.nodes[0]
        node.drive.compensation.raw[0x2021][0] = 0
        refused = node.set_data
        # a drive that keeps to itself what it is told of one object
        node.set_data = lambda index, *rest, **more: (
            None if index == 0x2024 else refused(index, *rest, **more)
        )
        with pytest.raises(DriverError, match="to be read back"):
            write_tables(there, [[first, unknown]])
        assert node.drive.compensation.raw[0x2021][0] == 0
        for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
            node.drive.image[slot.CONTROLWORD] = command.value
            node.drive.take_controlword()
        with pytest.raises(InputError, match=r"nothing was written: .*has power"):
            write_tables(there, [[first]])
        assert node.drive.compensation.raw[0x2021][0] == 0


def test_a_drive_that_compensates_friction_itself_is_sent_no_torque_ahead(rig):
    there = rig.model_copy(update={"bus": BusSettings(interface="virtual", channel="drive-tables-twice")})
    with simulated_rig(there, there.payload("none")):
        for value in (700, 0):
            write_tables(there, [[ObjectWrite(0x2021, 3, "int32", value)]])
            drives = RigDrives(there)
            try:
                if value:
                    with pytest.raises(DriveError, match=r"0x2021:03.*would act twice"):
                        drives.configure(torque=TORQUE_OFFSET)
                (stream,) = drives.configure(torque=None if value else TORQUE_OFFSET)
                assert stream.torque_entry == (None if value else TORQUE_OFFSET)
            finally:
                drives.close()


def test_a_family_with_one_support_point_gets_the_best_one_within_what_its_object_takes(result):
    rig = of_drive("beckhoff-ax2000")
    (joint,) = drive_tables(result, rig).joints
    (table,) = joint.tables
    assert [each.object for each in table.objects] == ["0x36A5:01", "0x36A4:01"]
    speed, current = (each.value for each in table.objects)
    assert 0 < speed <= 230_000  # 0.001 rpm
    assert current == pytest.approx(1000.0 * table.points[0][1], abs=0.51)  # mA
    assert table.points[0][2] == -table.points[0][1]
    assert table.left < table.wanted
    assert any("VUNIT" in remark for remark in joint.remarks)


def test_a_rig_whose_drives_take_no_tables_is_told_what_is_missing(result):
    with pytest.raises(
        InputError, match=r"no compensation tables are described .*generic-cia402.*section `compensation`"
    ):
        drive_tables(result, of_drive("generic-cia402"))


def test_the_command_shows_and_writes_nothing_where_drives_do_not_last(measured, capsys):
    command(NAME, str(measured[0]), "usual", as_json=True)
    assert not DriveTablesDocument.model_validate(json.loads(capsys.readouterr().out)).written
    with pytest.raises(InputError, match="live only as long as a session"):
        command(NAME, str(measured[0]), write=True, yes=True)
    command(NAME, clear=True)
    assert "nothing was written" in capsys.readouterr().out
    with pytest.raises(InputError, match="one of --experiment, --clear and --back-to"):
        command(NAME, str(measured[0]), clear=True)


def test_what_the_drives_held_is_kept_in_a_file_of_its_own_or_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(daq.homing, "require_lasting_drives", lambda _: None)
    monkeypatch.setattr(api.drive_tables, "write_tables", lambda *_: pytest.fail("it was written"))
    kept = tmp_path / "before.json"
    kept.write_text("what they held the first time")
    with pytest.raises(InputError, match=r"^--keep .*before\.json: exists already.* choose another name"):
        command(NAME, clear=True, write=True, yes=True, keep=kept)
    assert kept.read_text() == "what they held the first time"
    with pytest.raises(
        InputError, match=r"^--keep .*no/before\.json: .*no is no folder; what the drives hold"
    ):
        command(NAME, clear=True, write=True, yes=True, keep=tmp_path / "no" / "before.json")


def test_what_is_no_document_of_tables_is_named_in_one_line(tmp_path):
    binary = tmp_path / "tables.json"
    binary.write_bytes(b"\xff\xfe\x81{}")
    for file, problem in (
        (tmp_path / "none.json", "cannot be read: No such file or directory"),
        (tmp_path, "cannot be read: Is a directory"),
        (binary, "not JSON"),
    ):
        with pytest.raises(InputError, match=f"^{re.escape(str(file))}: {problem}") as refused:
            command(NAME, back_to=file)
        assert "\n" not in str(refused.value)


def test_torque_ripple_goes_into_the_cogging_table_about_the_encoder_s_zero(rig, result, monkeypatch):
    """A ripple of four waves a turn of the motor, beside the friction that was identified."""
    gear, home = rig.axes[0].gear_ratio, 0.3
    model = exported_model(result)
    ripple = Torque("torque-ripple", 0, 0, (f"cos({4.0 * gear} * q)",), (6.0,))
    monkeypatch.setattr(
        api.drive_tables, "exported_model", lambda _: replace(model, torques=(*model.torques, ripple))
    )
    turned = rig.model_copy(update={"axes": (rig.axes[0].model_copy(update={"home": home}),)})
    friction, cogging = drive_tables(result, turned).joints[0].tables
    assert friction.of == "friction"
    assert cogging.left < 0.1 * cogging.wanted
    ampere = 6.0 / float(rig.drive_gain[0, 0])
    wanted = [ampere * np.cos(4.0 * (2.0 * np.pi * share + gear * home)) for share, _ in cogging.points]
    assert [current for _, current in cogging.points] == pytest.approx(wanted, abs=0.1 * ampere)
    assert [each.value for each in cogging.objects] == pytest.approx(
        [1000.0 * a for a in wanted], abs=100.0 * ampere
    )
    one_point = of_drive("beckhoff-ax2000")
    (joint,) = drive_tables(result, one_point).joints
    assert [table.of for table in joint.tables] == ["friction"]
    assert any("ripple is left out" in remark for remark in joint.remarks)
