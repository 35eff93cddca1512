"""The following errors of a proof on the drive, drawn over time."""

import io

from daq.following_error import FollowingError
from daq.rig import Rig


def draw(rig: Rig, without: FollowingError, with_: FollowingError) -> bytes:
    """SVG: for each joint the following error without and with torque sent ahead."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    n = len(rig.axes)
    figure = Figure(figsize=(8.0, 1.0 + 1.8 * n), layout="constrained")
    rows = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for joint, (axis, place) in enumerate(zip(rig.axes, rows, strict=True)):
        unit, factor = ("mm", 1e3) if rig.robot.joints[joint].type == "prismatic" else ("mrad", 1e3)
        for error, label, colour in (
            (without, "without torque sent ahead", "#9aa4ae"),
            (with_, "with it", "#0b6bcb"),
        ):
            place.plot(
                error.cycle * rig.cycle,
                factor * error.error[:, joint],
                label=label,
                color=colour,
                linewidth=0.8,
            )
        place.set_ylabel(f"{axis.joint}, {unit}")
        place.grid(alpha=0.3)
    rows[0].set_title("Following error", loc="left")
    rows[0].legend(loc="upper right", fontsize="small")
    rows[-1].set_xlabel("time of the plan, s")
    written = io.BytesIO()
    FigureCanvasSVG(figure).print_svg(written)
    return written.getvalue()
