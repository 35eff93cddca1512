"""Who has a rig, and what its drives are asked for, through the service."""

from api.service.accounts import Role
from tests.api.rig_session import RIG, operator, prepare, take

__all__ = ["operator"]


def test_only_one_operator_operates_the_rig_and_the_other_sees_who(operator, service, clock):
    prepare(operator)
    other = service.client(Role.OPERATOR, "grace")
    refused = take(other, "session-00", "check")
    assert refused.status_code == 409
    assert "the-operator operates the rig" in refused.json()["detail"]
    assert other.post(f"/rigs/{RIG}/take").status_code == 409
    assert other.post(f"/rigs/{RIG}/release").status_code == 409
    assert other.get(f"/rigs/{RIG}").json()["onlookers"] == ["grace"]
    assert operator.post(f"/rigs/{RIG}/hand-over", json={"to": "grace"}).json()["operator"] == "grace"
    assert operator.post(f"/rigs/{RIG}/take").status_code == 409
    assert take(other, "session-00", "check").status_code == 200
    assert other.post(f"/rigs/{RIG}/release").json()["operator"] is None
    assert operator.post(f"/rigs/{RIG}/take").json()["operator"] == "the-operator"
    # Whoever left without releasing it does not keep it for ever.
    clock.advance(14 * 60)
    assert other.post(f"/rigs/{RIG}/take").status_code == 409
    clock.advance(2 * 60)
    assert other.post(f"/rigs/{RIG}/take").json()["operator"] == "grace"


def test_a_rig_is_handed_over_to_operators_only(operator, service):
    service.client(Role.VIEWER, "eve")
    operator.post(f"/rigs/{RIG}/take")
    for name in ("eve", "nobody"):
        answer = operator.post(f"/rigs/{RIG}/hand-over", json={"to": name})
        assert answer.status_code == 409
        assert "is not an operator" in answer.json()["detail"]


def test_an_absolute_encoder_drives_that_live_only_in_a_session_and_an_unknown_joint_are_not_homed(operator):
    short_lived = operator.post(f"/rigs/{RIG}/homing", json={"joint": "j3"})
    assert short_lived.status_code == 422
    assert "has an absolute encoder" in short_lived.json()["detail"]
    assert "`coulomb reset" in short_lived.json()["detail"]
    reset = operator.post(f"/rigs/{RIG}/reset")
    assert reset.status_code == 422
    assert "live only as long as a session" in reset.json()["detail"]
    unknown = operator.post(f"/rigs/{RIG}/homing", json={"joint": "j9"})
    assert unknown.status_code == 422
    assert "joint j9" in unknown.json()["detail"]
    assert operator.get(f"/rigs/{RIG}/homing").json() is None
