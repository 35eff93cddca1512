"""From recorded positions to velocities, accelerations and filtered, decimated columns."""

from identify.signals.cutoff import choose_signal_settings
from identify.signals.motion import MotionBlock, motion_blocks
from identify.signals.settings import SignalSettings

__all__ = ["MotionBlock", "SignalSettings", "choose_signal_settings", "motion_blocks"]
