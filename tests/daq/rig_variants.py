"""The simulated rig with other limits, or with a drive that fails on purpose."""

from daq.rig import Rig


def with_faults(rig: Rig, **faults: object) -> Rig:
    """The rig with a drive that fails as the settings `faults` of a simulated drive say."""
    drive = {**rig.simulated["drives"][0], "faults": faults}
    return rig.model_copy(update={"simulated": {**rig.simulated, "drives": [drive]}})


def with_limits(rig: Rig, **limits: object) -> Rig:
    """The rig with other limits of its first axis."""
    axis = rig.axes[0]
    changed = axis.model_copy(update={"limits": axis.limits.model_copy(update=limits)})
    return rig.model_copy(update={"axes": (changed,)})


def with_storage(rig: Rig, **storage: object) -> Rig:
    """The rig with other settings of how samples come to disk."""
    return rig.model_copy(update={"storage": rig.storage.model_copy(update=storage)})
