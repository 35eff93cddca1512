"""The certificate of an export as text for the terminal."""

from collections.abc import Iterator

from identify.results.certificate import Certificate


def certificate_text(certificate: Certificate) -> str:
    """What an exported file keeps of the model, and what that costs."""
    return "\n".join(_lines(certificate))


def _lines(certificate: Certificate) -> Iterator[str]:
    yield f"{certificate.target}: {certificate.kind} of {certificate.experiment}, model {certificate.model}"
    if certificate.not_measured is None:
        yield f"checked with: {certificate.checked_with}"
    else:
        yield f"not measured: {certificate.not_measured}"
    for joint in certificate.joints:
        file = "not measured" if certificate.not_measured else _percent(joint.relative_error_export)
        yield ""
        apart = (
            ""
            if joint.relative_difference is None
            else f"; {joint.relative_difference:.1g} off the model's torque"
        )
        yield (
            f"{joint.joint}: relative error of the model {_percent(joint.relative_error_model)},"
            f" of the file {file}{apart}"
        )
        for word, effects in (
            ("kept", joint.kept),
            ("approximated", joint.approximated),
            ("lost", joint.lost),
        ):
            if effects:
                yield f"  {word:13s} {', '.join(effects)}"
    for remark in certificate.remarks:
        yield ""
        yield f"Remark: {remark}"


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.2f} %"
