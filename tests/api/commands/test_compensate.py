"""`coulomb compensate` before anything moves: what is prepared, what of a stored proof is driven on, what is refused."""

from datetime import UTC, datetime

import pytest
import typer

from api.commands import compensate as command
from api.compensation import torque_ahead
from api.proof import Proof, next_folder
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from identify.identification import identify
from identify.recording import InputError, load_experiment
from tests.api.driven_arm import write_driven_arm

RIG = "rx130l-joint3-simulated"
PAYLOAD = "disk-3.5"


@pytest.fixture(scope="module")
def source(rig, tmp_path_factory):
    folder = tmp_path_factory.mktemp("driven") / "arm"
    write_driven_arm(folder, rig)
    return load_experiment(folder)


@pytest.fixture(scope="module")
def prepared(source, rig):
    """A new proof of a standard plan of 20 s, not stored."""
    return command._new_proof(source, rig, None, 20.0, PAYLOAD, "load-velocity", [], "friction", 0.5, "ada")


def test_a_new_proof_is_of_what_was_asked_and_writes_nothing(source, rig, prepared):
    asked = prepared.settings
    assert (asked.experiment, asked.rig, asked.plan) == ("arm", RIG, "standard")
    assert (asked.payload, asked.model, asked.add) == (rig.payload(PAYLOAD), "load-velocity", ())
    assert (asked.part, asked.share, asked.operator) == ("friction", 0.5, "ada")
    assert (datetime.now(UTC) - datetime.fromisoformat(asked.created)).days == 0
    assert prepared.plan == standard_plan(rig, 20.0)
    expected = torque_ahead(
        identify(source, "load-velocity"), rig, prepared.plan, rig.payload(PAYLOAD), "friction", 0.5
    )
    assert (prepared.ahead.offset.counts == expected.offset.counts).all()
    assert prepared.name == "00"
    assert not prepared.folder.parent.exists()


@pytest.fixture
def stored(source, rig, prepared, tmp_path):
    """The same experiment with proofs 00 and 01 prepared."""
    folder = tmp_path / "arm"
    write_driven_arm(folder, rig)
    for _ in range(2):
        Proof(next_folder(folder), prepared.settings, rig, prepared.plan, prepared.ahead).store()
    return load_experiment(folder)


def test_a_proof_is_gone_on_with_by_its_number_with_or_without_its_payload(stored, rig, prepared):
    for number, payload in (("1", None), ("01", PAYLOAD)):
        found = command._stored_proof(stored, rig, number, payload)
        assert (found.name, found.settings) == ("01", prepared.settings)


@pytest.mark.parametrize(
    ("number", "payload", "words"),
    [
        ("3", None, r"--continue 3: experiment arm has no proof of this number; it has: 00, 01$"),
        ("²", None, "has no proof of this number"),
        ("1", "none", r"--continue 1: the proof is with payload disk-3\.5, not none$"),
    ],
)
def test_a_proof_of_another_number_or_payload_is_refused(stored, rig, number, payload, words):
    with pytest.raises(InputError, match=words):
        command._stored_proof(stored, rig, number, payload)


def test_a_proof_of_another_rig_is_refused_and_where_there_is_none_it_is_said(stored, source, rig):
    other = rig.model_copy(update={"name": "another"})
    with pytest.raises(InputError, match=f"the proof is of rig {RIG}, not another"):
        command._stored_proof(stored, other, "1", None)
    with pytest.raises(InputError, match=r"it has: none$"):
        command._stored_proof(source, rig, "1", None)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"payload": "nothing"}, "nothing"),
        ({"payload": None}, "--payload: the name of a payload"),
        ({"payload": None, "proof": "77"}, "no proof of this number"),
        ({"payload": None, "proof": "²"}, "no proof of this number"),
    ],
)
def test_the_command_refuses_before_anything_moves(source, arguments, words):
    with pytest.raises(InputError, match=words):
        command.compensate(RIG, str(source.folder), yes=True, **arguments)


def test_only_a_simulated_rig_is_started_without_asking(source, tmp_path):
    real = Rig.load(RIG).model_copy(update={"simulated": None, "pacing": "real-time"})
    (tmp_path / "real.yaml").write_text(real.model_dump_json(exclude_none=True, exclude_defaults=True))
    with pytest.raises(InputError, match="--yes: is for simulated rigs"):
        command.compensate(str(tmp_path / "real.yaml"), str(source.folder), payload=PAYLOAD, yes=True)


@pytest.mark.parametrize(
    ("mass", "yes", "weighed"), [(3.46, False, 3.46), (0.0, True, 0.0), (None, True, 3.4584)]
)
def test_the_mass_is_as_stated_or_the_payloads_own_and_what_was_not_driven_is_forgotten(
    source, rig, monkeypatch, mass, yes, weighed
):
    """The drive itself is that of `coulomb run`; here the person turns away from it."""
    asked = []

    def turned_away(console, session, weigh, started):
        asked.append((session.payload.name, weigh(), started))
        assert (source.folder / "compensation" / "00").is_dir()
        return False

    monkeypatch.setattr("api.commands.run.conduct", turned_away)
    with pytest.raises(typer.Exit) as ended:
        command.compensate(RIG, str(source.folder), payload=PAYLOAD, seconds=20.0, mass=mass, yes=yes)
    assert ended.value.exit_code == 1
    assert asked == [(PAYLOAD, weighed, yes)]
    assert not (source.folder / "compensation").exists()
