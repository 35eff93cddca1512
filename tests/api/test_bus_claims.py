"""One owner of every bus: whoever wants one asks, and the end of a claim gives it back."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from api.service.bus_claims import BusClaims
from api.service.problems import Problem
from drivers.bus import BusSettings

ROOT = Path(__file__).parents[2]
HOLD = """
import sys
from drivers.bus import BusSettings
from drivers.bus_claim import BusClaim
with BusClaim(BusSettings(interface="socketcan", channel=sys.argv[1]), "a test"):
    print("held", flush=True)
    sys.stdin.read()
"""
CAN0 = BusSettings(interface="socketcan", channel="can0")


@dataclass
class Holder:
    moves: bool = False
    refusal: str = "The session s of e has this rig; finish or discard it."


def test_a_claimed_bus_is_refused_with_what_has_it_until_it_is_released():
    claims, session = BusClaims(), Holder()
    claim = claims.claim("arm", CAN0, session)
    assert claims.holder("arm") is session
    with pytest.raises(Problem, match="Rig arm: The session s of e has this rig") as refused:
        claims.claim("arm", CAN0, Holder())
    assert refused.value.status == 409
    claim.release()
    claim.release()
    assert claims.holder("arm") is None
    with claims.claim("arm", CAN0, Holder()):
        assert claims.holder("arm") is not None
    assert claims.holder("arm") is None


def test_a_bus_that_another_program_of_this_computer_uses_is_refused_with_its_process():
    bus = CAN0.model_copy(update={"channel": f"test{os.getpid()}"})
    claims = BusClaims()
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, bus.channel],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(Problem, match=f"Rig arm: its bus .* is in use by process {other.pid}") as refused:
            claims.claim("arm", bus, Holder())
        other.kill()
    assert refused.value.status == 409
    assert claims.holder("arm") is None
    claims.claim("arm", bus, Holder()).release()


def test_two_rig_files_on_one_interface_share_its_bus():
    claims = BusClaims()
    claims.claim("arm", CAN0, Holder())
    with pytest.raises(Problem, match=r"Rig arm on the same bus \(socketcan channel can0\)"):
        claims.claim("arm-with-gripper", CAN0.model_copy(update={"bitrate": 500_000}), Holder())
    claims.claim("other", CAN0.model_copy(update={"channel": "can1"}), Holder())


def test_virtual_buses_of_two_rigs_are_two_buses_whatever_their_channel_is_called():
    claims, virtual = BusClaims(), BusSettings(interface="virtual", channel="coulomb")
    claims.claim("a", virtual, Holder())
    claims.claim("b", virtual, Holder())
    with pytest.raises(Problem):
        claims.claim("a", virtual, Holder())


def test_a_stale_release_does_not_take_the_bus_from_who_claimed_it_since():
    claims = BusClaims()
    first = claims.claim("arm", CAN0, Holder())
    first.release()
    second = Holder()
    claims.claim("arm", CAN0, second)
    first.release()
    assert claims.holder("arm") is second


def test_whether_a_rig_moves_is_what_the_holder_of_its_bus_says():
    claims, holder = BusClaims(), Holder()
    assert not claims.moves("arm")
    claim = claims.claim("arm", CAN0, holder)
    assert not claims.moves("arm")
    holder.moves = True
    assert claims.moves("arm")
    claim.release()
    assert not claims.moves("arm")
