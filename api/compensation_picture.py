"""The following errors of a proof on the drive, drawn over time with the planned position."""

import io

from api.proof import FollowingErrors
from daq.rig import Rig


def draw(rig: Rig, errors: FollowingErrors) -> bytes:
    """SVG: for each joint the following error without and with feedforward torque, and the position as planned."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    n = len(rig.axes)
    figure = Figure(figsize=(8.0, 1.0 + 1.8 * n), layout="constrained")
    rows = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for joint, (axis, place) in enumerate(zip(rig.axes, rows, strict=True)):
        unit, factor = ("mm", 1e3) if rig.robot.joints[joint].type == "prismatic" else ("mrad", 1e3)
        planned = place.twinx()
        planned.plot(errors.time, errors.position[:, joint], color="#c8b27a", linewidth=0.8, linestyle="--")
        planned.set_ylabel(f"planned, {'m' if unit == 'mm' else 'rad'}", color="#8a7440")
        place.set_zorder(planned.get_zorder() + 1)
        place.patch.set_visible(False)
        for error, label, colour in (
            (errors.before, "without feedforward torque", "#9aa4ae"),
            (errors.after, "with it", "#0b6bcb"),
        ):
            place.plot(errors.time, factor * error[:, joint], label=label, color=colour, linewidth=0.8)
        place.set_ylabel(f"{axis.joint}, {unit}")
        place.grid(alpha=0.3)
    rows[0].set_title("Following error", loc="left")
    rows[0].legend(loc="upper right", fontsize="small")
    rows[-1].set_xlabel("time of the plan, s")
    written = io.BytesIO()
    FigureCanvasSVG(figure).print_svg(written)
    return written.getvalue()
