"""Relative errors of groups (payloads, sessions) as horizontal bars: one bar for each model."""

from collections.abc import Sequence

from markupsafe import Markup

from api.pages.figures.choosable import groups_json
from api.pages.figures.drawing import Scale, element, picture, text
from api.pages.number_format import percent


def draw_group_bars(
    groups: Sequence[tuple[str, Sequence[float | None]]], label: str, width: float = 420
) -> Markup:
    """Draw for each (name, relative errors) its bars from zero; the first model violet, the second grey. Beneath them there is
    room for a thin bar of the samples that a person chooses."""
    models = max((len(errors) for _, errors in groups), default=1)
    slot = 13.0 * models + 22.0
    height = slot * len(groups) + 12.0
    left, right = 112.0, width - 62.0
    longest = max((error for _, errors in groups for error in errors if error is not None), default=0.0)
    x = Scale(0.0, longest or 1.0, left, right)
    content, beneath = [], {}
    for row, (name, errors) in enumerate(groups):
        top = 4.0 + row * slot
        beneath[name] = top + 13.0 * models + 1.0
        shown = name if len(name) <= 18 else name[:17] + "…"
        content.append(text(left - 9, top + 6.5 * models + 4, shown, "end title"))
        for index, error in enumerate(errors):
            y = top + 13.0 * index
            if error is None:
                content.append(text(left + 4, y + 9.5, "no samples", "faint"))
                continue
            class_ = "bar-error" if index == 0 else "bar-before"
            content.append(
                element("rect", x=left, y=y + 1, width=x(error) - left, height=10.0, class_=class_)
            )
            content.append(text(x(error) + 6, y + 9.8, percent(error), "strong" if index == 0 else ""))
    rows = groups_json(x, beneath)
    return picture(width, height, f"Relative error by {label}", *content, groups=rows)
