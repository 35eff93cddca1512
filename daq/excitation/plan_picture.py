"""A picture of a plan: position, speed and predicted current of every joint against their limits."""

from pathlib import Path

import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.optimal_excitation import Request
from daq.excitation.plan_model import PlannedMotion
from identify.recording.errors import InputError

PIXELS_WORTH = 4000
"""samples drawn: more than a page has dots"""


def draw_plan(plan: ExcitationPlan, request: Request, file: Path) -> None:
    """Write the picture; its format follows the file's ending (png, svg, pdf).

    Raises InputError where the format is not known or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = len(plan.joints)
    figure = Figure(figsize=(max(7.0, 3.6 * n), 8.0), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    formats = canvas.get_supported_filetypes()
    if file.suffix.removeprefix(".").lower() not in formats:
        raise InputError(f"{file}: a picture ends in one of {', '.join(sorted(formats))}")
    axes = figure.subplots(3, n, squeeze=False, sharex=True)
    time = np.linspace(0.0, plan.duration, PIXELS_WORTH)
    setpoints = plan.setpoints(time)
    gain = request.rig.drive_gain
    currents = [
        np.linalg.solve(
            gain, request.model.torque(PlannedMotion(payload, time, *setpoints, float(time[1]))).T
        ).T
        for payload in request.payloads
    ]
    for j, axis in enumerate(request.rig.axes):
        limits = axis.limits
        unit = "m" if request.rig.robot.joints[j].type == "prismatic" else "rad"
        position, speed, current = axes[0, j], axes[1, j], axes[2, j]
        position.plot(time, setpoints.position[:, j], linewidth=0.8)
        speed.plot(time, setpoints.velocity[:, j], linewidth=0.8)
        for payload, values in zip(request.payloads, currents, strict=True):
            current.plot(time, values[:, j], linewidth=0.6, label=payload.name)
        for panel, low, high in (
            (position, *limits.position),
            (speed, -limits.velocity, limits.velocity),
            (current, -limits.current, limits.current),
        ):
            panel.axhline(low, color="tab:red", linestyle="--", linewidth=0.8)
            panel.axhline(high, color="tab:red", linestyle="--", linewidth=0.8)
            for begin, end, _ in plan.repeated:
                panel.axvspan(begin, end, color="tab:green", alpha=0.07, linewidth=0.0)
        position.set_title(axis.joint)
        position.set_ylabel(f"position, {unit}")
        speed.set_ylabel(f"speed, {unit}/s")
        current.set_ylabel("predicted current, A")
        current.set_xlabel("time, s")
    axes[2, 0].legend(fontsize="small", title="payload", loc="lower left")
    figure.suptitle(  # pyright: ignore[reportUnknownMemberType]  matplotlib leaves **kwargs untyped
        f"{plan.name} on {request.rig.name}; dashed: limits; green: repeats exactly", fontsize="medium"
    )
    try:
        figure.savefig(file, dpi=120)  # pyright: ignore[reportUnknownMemberType]
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror or error})") from None
