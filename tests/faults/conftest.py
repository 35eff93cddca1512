"""The rig, plan and sessions of the acquisition's tests."""

from tests.daq.conftest import armed_session, rig, short_plan

__all__ = ["armed_session", "rig", "short_plan"]
