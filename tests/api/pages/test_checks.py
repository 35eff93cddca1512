"""The panel with what the check of the rig found."""

from api.pages.rendering import environment
from daq.rig_check import CheckItem

GRANTED = CheckItem("this computer", True, "memory locked")
ADVICE = CheckItem("this computer", True, "no real-time priority: allow it", advice=True)
FAULT = CheckItem("joint j3", False, "is not homed")


def panel(*items: CheckItem) -> str:
    passed, failed = [item for item in items if item.ok], [item for item in items if not item.ok]
    return environment().get_template("checks.html").render(passed=passed, failed=failed)


def test_advice_is_seen_without_opening_what_is_in_order():
    shown, folded = panel(GRANTED, ADVICE, FAULT).split("<details")
    assert (
        '<span class="state warn">this computer</span><span>no real-time priority: allow it</span>' in shown
    )
    assert '<span class="state fault">joint j3</span>' in shown
    assert "2 of 3 checks in order, 1 with advice" in folded
    assert "memory locked" in folded
    assert "allow it" not in folded


def test_without_advice_and_faults_all_is_folded_away():
    shown, folded = panel(GRANTED).split("<details")
    assert "all in order" in shown
    assert "findings" not in shown
    assert "1 of 1 checks in order<" in folded
