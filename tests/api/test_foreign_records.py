"""Other people's records through the service: described with guesses, imported by them, refused by field."""

import json
import struct

import numpy as np
import pytest

from api.service.accounts import Role
from identify.recording import load_experiment

TIME = np.arange(0, 4, 0.005)
POSITION = np.sin(2 * TIME)
CURRENT = 0.4 * np.cos(2 * TIME) + 1.5 * np.sin(POSITION) + 0.2 * np.sign(np.cos(2 * TIME))
JOINT = {"position": "Istlage [Grad]", "command": "Motorstrom [mA]", "gain": 10.0}
SETTINGS = {
    "name": "Prüfstand 3",
    "time": ["Zeit [ms]"],
    "gravity": [0.0, -9.81, 0.0],
    "joints": [JOINT],
}
URDF = """<robot name="arm"><link name="base"/>
<link name="arm"><inertial><mass value="2.5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit effort="1" velocity="1" lower="-1" upper="1"/></joint></robot>"""


def german(position=POSITION):
    """A control cabinet's export: preamble, semicolons, decimal commas, cp1252."""
    rows = zip(1000 * TIME, np.degrees(position), 1000 * CURRENT, strict=True)
    cells = "".join(";".join(f"{value:.4f}".replace(".", ",") for value in row) + "\r\n" for row in rows)
    return f"Prüfstand 3\r\n\r\nZeit [ms];Istlage [Grad];Motorstrom [mA]\r\n{cells}".encode("cp1252")


@pytest.fixture
def operator(service):
    return service.client(Role.OPERATOR)


def sent(operator, settings, *files, robot=None):
    parts = [
        ("files", (f"messung-{place}.csv", content)) for place, content in enumerate(files or (german(),))
    ]
    parts += [("robot", ("arm.urdf", robot))] if robot else []
    return operator.post("/experiments/import/records", data={"settings": json.dumps(settings)}, files=parts)


def test_columns_are_described_with_their_roles_and_nothing_is_kept(operator, data_folder):
    answer = operator.post("/experiments/import/columns", files=[("files", ("../../a b.csv", german()))])
    assert answer.status_code == 200, answer.text
    [described] = answer.json()
    assert described["file"] == "a_b.csv"
    assert (described["time"], described["position"]) == ("Zeit [ms]", ["Istlage [Grad]"])
    assert described["command"] == ["Motorstrom [mA]"]
    lage = described["columns"][1]
    assert (lage["unit"], lage["samples"]) == ("deg", 800)
    assert lage["largest"] == pytest.approx(np.degrees(1), abs=0.01)
    assert max(lage["outline"]) == lage["largest"]
    assert list((data_folder / "experiments").iterdir()) == []


def test_a_dialect_that_is_given_overrules(operator):
    rows = "".join(f"{0.01 * k:.2f},{k % 7}\n" for k in range(40))
    parts = [("files", ("a.csv", f"7,8\n{rows}".encode()))]
    [described] = operator.post("/experiments/import/columns", data={"header_line": 0}, files=parts).json()
    assert [column["name"] for column in described["columns"]] == ["1", "2"]
    assert described["columns"][0]["samples"] == 41


def test_records_become_an_experiment_in_si(operator, service):
    answer = sent(
        operator,
        SETTINGS | {"payloads": [{}, {"name": "disk", "mass": 3.5}]},
        german(),
        german(0.5 * POSITION),
    )
    assert answer.status_code == 201, answer.text
    document = answer.json()
    assert document["experiment"]["name"] == "Prüfstand 3"
    assert document["job"]["kind"] == "identify"
    assert any("deg -> rad" in remark for remark in document["decided"])
    experiment = load_experiment(service.service.experiments.folder(document["experiment"]["id"]))
    first, second = experiment.sessions
    assert (first.payload.name, second.payload.mass) == ("none", 3.5)
    read = experiment.read(first)
    np.testing.assert_allclose(read.position[:, 0], POSITION, atol=1e-5)
    np.testing.assert_allclose(read.command[:, 0], CURRENT, atol=1e-5)


def test_files_are_joined_and_the_robot_may_be_a_urdf(operator, service):
    text = german().decode("cp1252")
    rows = [line.split(";") for line in text.splitlines()[2:]]
    apart = ["\n".join(";".join(row[k] for k in kept) for row in rows).encode() for kept in ((0, 1), (0, 2))]
    settings = {"name": "joined", "join": True, "time": ["Zeit [ms]"], "joints": [JOINT]}
    answer = sent(operator, settings, *apart, robot=URDF)
    assert answer.status_code == 201, answer.text
    experiment = load_experiment(service.service.experiments.folder(answer.json()["experiment"]["id"]))
    assert [joint.name for joint in experiment.robot.joints] == ["shoulder"]
    assert experiment.robot.joints[0].drive_gain == 10.0
    assert experiment.prior is not None
    assert (experiment.prior.source, experiment.prior.links[0].mass) == ("arm.urdf", 2.5)
    assert len(experiment.sessions) == 1


def with_more(position=POSITION):
    """The export with a second sensor's torque, a temperature and a counter."""
    first, *lines = german(position).decode("cp1252").splitlines()[2:]
    more = [f"{line};{0.5 * k:.1f};{20 + k / 100:.2f};{k}".replace(".", ",") for k, line in enumerate(lines)]
    return "\n".join([f"{first};Last [Nm];Temp [°C];Zyklus", *more]).encode("cp1252")


def test_sessions_are_added_to_an_experiment_with_forces_temperatures_and_columns_to_keep(operator, service):
    made = sent(operator, SETTINGS).json()["experiment"]["id"]
    joint = JOINT | {"gain": None, "external": "Last [Nm]", "temperature": "Temp [°C]"}
    added = {
        "experiment": made,
        "time": ["Zeit [ms]"],
        "joints": [joint],
        "keep": ["Zyklus"],
        "role": "validation",
    }
    robot = (
        "<robot name='arm'><link name='base'/><link name='l1'><inertial><mass value='4'/></inertial></link>"
    )
    robot += "<joint name='j1' type='revolute'><parent link='base'/><child link='l1'/><axis xyz='0 0 1'/></joint></robot>"
    other = robot.replace("xyz='0 0 1'", "xyz='0 1 0'")
    refused = sent(operator, added, with_more(), robot=other)
    assert (refused.status_code, "its inertias are in other frames" in refused.text) == (422, True)
    answer = sent(operator, added | {"payloads": [{"name": "disk", "mass": 3.5}]}, with_more(), robot=robot)
    assert answer.status_code == 201, answer.text
    assert answer.json()["experiment"]["id"] == made
    experiment = load_experiment(service.service.experiments.folder(made))
    assert [(each.file, each.payload.name, each.role) for each in experiment.sessions] == [
        ("session-00.csv", "none", "identification"),
        ("session-01.csv", "disk", "validation"),
    ]
    assert experiment.prior is not None
    assert experiment.prior.links[0].mass == 4.0
    read = experiment.read(experiment.sessions[1])
    np.testing.assert_allclose(read.external[:, 0], 0.5 * np.arange(800), atol=1e-9)
    np.testing.assert_allclose(read.temperature[:, 0], 20 + np.arange(800) / 100, atol=1e-9)
    np.testing.assert_array_equal(read.extra["Zyklus"], np.arange(800))
    for change, status in (
        ({"experiment": "elsewhere"}, 404),
        ({"payloads": [{"name": "disk", "mass": 9}]}, 409),
        ({"joints": [joint, joint | {"position": "Last [Nm]"}]}, 422),
    ):
        assert sent(operator, added | change, with_more()).status_code == status
    assert len(load_experiment(experiment.folder).sessions) == 2


RIG = "rx130l-joint3-simulated"


def can_log(rows=600):
    """What candump shows of the rig's drive: SYNC every 2 ms, and position, current and status word behind it."""
    lines = []
    for k in range(rows):
        data = struct.pack("<ihH", round(50_000 * np.sin(k / 60)), round(900 * np.cos(k / 60)), 0x1237)
        for place, frame in enumerate((" 080   [0]", f" 183   [8]  {data.hex(' ')}")):
            lines.append(f" ({1_700_000_000 + 0.002 * k + 0.0002 * place:.6f})  can0 {frame}\n")
    return "".join(lines).encode()


def logs_sent(operator, settings, *files):
    parts = [("files", (f"bus-{place}.log", content)) for place, content in enumerate(files or (can_log(),))]
    return operator.post("/experiments/import/can-logs", data={"settings": json.dumps(settings)}, files=parts)


def test_logs_of_a_can_bus_become_sessions_by_a_rigs_mapping(operator, service, data_folder):
    answer = logs_sent(operator, {"rig": RIG, "payload": "disk-7", "name": "logged"}, can_log(), can_log(500))
    assert answer.status_code == 201, answer.text
    made = answer.json()["experiment"]["id"]
    assert any("all drives were enabled" in words for words in answer.json()["decided"])
    added = logs_sent(
        operator, {"rig": RIG, "experiment": made, "role": "validation", "begin": 0.2, "end": 0.8}
    )
    assert added.status_code == 201, added.text
    experiment = load_experiment(service.service.experiments.folder(made))
    assert [(each.file, each.payload.name, each.role) for each in experiment.sessions] == [
        ("session-00.h5", "disk-7", "identification"),
        ("session-01.h5", "disk-7", "identification"),
        ("session-02.h5", "none", "validation"),
    ]
    assert [len(experiment.read(entry).time) for entry in experiment.sessions] == [600, 500, 301]
    other = sent(operator, SETTINGS).json()["experiment"]["id"]
    for change, status, words in (
        ({"payload": "feather"}, 422, "'feather' is not known"),
        ({"rig": "nowhere"}, 404, "nowhere"),
        ({"experiment": other}, 422, "its robot is not that of the rig"),
        ({"begin": 5.0, "end": 6.0}, 422, "bus-0.log: holds no 16 cycles"),
        ({}, 422, "bus-0.log: holds no SYNC"),
    ):
        log = can_log(40) if change else can_log(40).replace(b" 080 ", b" 081 ")
        refused = logs_sent(operator, {"rig": RIG} | change, log)
        assert refused.status_code == status, refused.text
        assert words in refused.json()["detail"]
        assert str(data_folder) not in refused.json()["detail"]
    assert len(list((data_folder / "experiments").iterdir())) == 2


WRONG = [
    ({"time": []}, "time: is missing"),
    ({"gravity": None}, "gravity: is missing"),
    ({"joints": [JOINT | {"gain": None}]}, "joints.0.gain: is missing"),
    ({"joints": [JOINT | {"position": "Lage"}]}, "messung-0.csv: there is no column 'Lage'"),
    ({"joints": [JOINT | {"position_unit": "furlong"}]}, "position_unit: 'furlong' is not known"),
    ({"joints": [JOINT | {"position_unit": "counts"}]}, "resolution is missing"),
    ({"joints": [JOINT | {"command": "Istlage [Grad]"}]}, "Istlage [Grad]"),
    ({"joints": [JOINT, JOINT | {"position": "#1", "position_unit": "deg"}]}, "joints.0.position_unit"),
    ({"payloads": [{}, {}]}, "payloads: 2 given for 1 sessions"),
    ({"name": "a/b"}, "name"),
    ({"joints": []}, "joints"),
    ({"dialect": {"separator": "^"}}, "separator"),
]


def test_what_is_wrong_is_refused_by_its_field_and_leaves_nothing(operator, data_folder):
    for change, words in WRONG:
        answer = sent(operator, SETTINGS | change)
        assert answer.status_code == 422, answer.text
        detail = answer.json()["detail"]
        assert words in detail
        for stranger in ("--", "\n", str(data_folder)):
            assert stranger not in detail
    assert list((data_folder / "experiments").iterdir()) == []
