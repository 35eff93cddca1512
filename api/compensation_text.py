"""A proof on the drive as text for the terminal."""

from collections.abc import Iterator

from identify.results.compensation import CompensationDocument

HELD_OVER_THE_BUS = (
    "Both runs in cyclic torque mode: the axes were held by this computer's position loop over the bus. What the torque did is of"
    " that loop; the drive's own was not judged."
)


def compensation_text(document: CompensationDocument) -> str:
    """`compensate --json` as text."""
    return "\n".join(_lines(document))


def _lines(document: CompensationDocument) -> Iterator[str]:
    sent = "model" if document.part == "whole" else "friction alone"
    model = " + ".join([document.model, *document.add])
    yield (
        f"{document.rig}, payload {document.payload}: torque of {model} ({sent}) from {document.experiment} as"
        f" feedforward, at most {100 * document.share:g} % of the current limit"
    )
    if document.held_by != "drive":
        yield HELD_OVER_THE_BUS
    if not document.completed:
        yield f"stopped: {document.reason}"
    for joint in document.joints:
        yield ""
        yield f"{joint.joint}: following error, root mean square (largest {joint.largest_offset:.3g} A sent)"
        yield f"  {'':34s} {'without':>12s} {'with':>12s}"
        rows = [("all of the plan", joint.rms_without, joint.rms_with)]
        rows += [(part.where, part.rms_without, part.rms_with) for part in (*joint.speeds, *joint.quadrants)]
        rows.append(("peak", joint.peak_without, joint.peak_with))
        for label, without, with_ in rows:
            yield f"  {label:34s} {_figure(without, joint.unit):>12s} {_figure(with_, joint.unit):>12s}{_change(without, with_)}"
    yield ""
    yield f"stored with the experiment in {document.folder}"


def _figure(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{1e3 * value:.4f} m{unit}"


def _change(without: float | None, with_: float | None) -> str:
    return "" if not without or with_ is None else f"  {100 * (with_ / without - 1):+.0f} %"
