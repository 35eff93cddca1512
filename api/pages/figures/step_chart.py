"""The error over model versions as a descending staircase, with the noise floor as a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

from markupsafe import Markup

from api.pages.figures.drawing import Scale, element, line, path_data, picture, round_ticks, text
from api.pages.number_format import number, percent

LABEL_HEIGHT = 22.0
"""Units above a node that its figure takes."""


MOTION = "beneath the models: position 1 s ahead, unseen motion, rms"
"""what the errors of motion are"""


@dataclass(frozen=True)
class ModelStep:
    """One model version: what it is called under the chart, its relative errors (fractions), and whether it is undone.

    other_data : its error is of other data than the current version's (`2 sessions`); no line then leads to it, for a step
                 between errors of different data says nothing of the model
    """

    label: str
    relative_error: float
    relative_error_validation: float | None = None
    undone: bool = False
    current: bool = False
    other_data: str | None = None

    motion: str | None = None
    """error of predicted motion, with its unit; None where nobody asked"""
    motion_worse: bool = False
    """whether motion is predicted worse than by the usual model, or than by the version before"""

    @property
    def on_the_line(self) -> float | None:
        """The error where it can be compared with the current one's."""
        return self.relative_error if self.other_data is None else None


def draw_step_chart(
    steps: Sequence[ModelStep], noise_floor: float | None, width: float = 420, height: float = 190
) -> Markup:
    """Draw the relative error (fractions, shown in percent) of each version from left to right."""
    # a row for the errors of motion, and one that says what they are
    beneath = 26.0 if any(step.motion for step in steps) else 0.0
    left, right, top, bottom = 40.0, width - 10.0, 18.0, height - 34.0 - beneath
    errors = [step.relative_error for step in steps]
    errors += [step.relative_error_validation for step in steps if step.relative_error_validation is not None]
    y = Scale(0.0, (max(errors, default=0.0) or 0.01) * 1.08, bottom, top)
    slot = (right - left) / max(len(steps), 4)
    ticks = round_ticks(0.0, y.high * 100, 4)
    decimals = 1 if len(ticks) > 1 and ticks[1] < 1 else 0
    content = [
        line(left, y(tick / 100), right, y(tick / 100), "axis" if tick == 0 else "grid-line")
        for tick in ticks
    ]
    content += [text(left - 7, y(tick / 100) + 3.8, number(tick, decimals), "end") for tick in ticks]
    content.append(text(left - 7, top - 4, "%", "end faint"))
    content += _staircase(list(steps), left, slot, y)
    if beneath:
        content.append(text(right, height - 4, MOTION, "end faint"))
    if noise_floor is not None and noise_floor < y.high:
        content.append(line(left, y(noise_floor), right, y(noise_floor), "floor"))
        below = y(noise_floor) + 12 < bottom
        content.append(
            text(
                right,
                y(noise_floor) + (12 if below else -5),
                f"noise floor {percent(noise_floor)}",
                "end floor-text",
            )
        )
    return picture(width, height, "Relative error over model versions", *content)


def _staircase(steps: Sequence[ModelStep], left: float, slot: float, y: Scale) -> list[str]:
    done = [step for step in steps if not step.undone]
    content = []
    checked = [
        (i, step.relative_error_validation)
        for i, step in enumerate(done)
        if step.relative_error_validation and step.other_data is None
    ]
    if checked:
        x, values = [], []
        for index, value in checked:
            x += [left + index * slot, left + (index + 1) * slot]
            values += [y(value), y(value)]
        content.append(element("path", d=path_data(x, values), class_="validation"))
    for kind, chosen in (("step undone", steps[max(len(done) - 1, 0) :]), ("step", done)):
        offset = len(done) - 1 if kind == "step undone" else 0
        x, values = [], []
        for index, step in enumerate(chosen, start=max(offset, 0)):
            x += [left + index * slot, left + (index + 1) * slot]
            level = nan if step.on_the_line is None else y(step.on_the_line)
            values += [level, level]
        if kind == "step" or len(chosen) > 1:
            content.append(element("path", d=path_data(x, values), class_=kind))
    for index, step in enumerate(steps):
        centre = left + (index + 0.5) * slot
        state = " now" if step.current else " undone" if step.undone else ""
        state += " other-data" if step.other_data else ""
        content.append(element("circle", cx=centre, cy=y(step.relative_error), r=4.0, class_=f"node{state}"))
        content.append(
            text(
                centre,
                y(step.relative_error) + _label_offset(step, y),
                number(100 * step.relative_error, 2),
                "middle strong" if step.current else "middle",
            )
        )
        if step.current and step.relative_error_validation is not None:
            checked = step.relative_error_validation
            content.append(text(centre + 0.5 * slot + 5, y(checked) + 3.8, number(100 * checked, 2), "faint"))
        content += [
            text(centre, y.start + 14 + 12 * row, line, "middle title" if step.current else "middle")
            for row, line in enumerate(_two_lines(step.label, slot))
        ]
        if step.other_data:
            content.append(text(centre, y(step.relative_error) + 17.0, step.other_data, "middle faint"))
        if step.motion is not None:
            error = f"{step.motion} ↑" if step.motion_worse else step.motion
            content.append(
                text(
                    centre, y.start + 40, error, "middle limit-text" if step.motion_worse else "middle faint"
                )
            )
    return content


def _label_offset(step: ModelStep, y: Scale) -> float:
    """Where a figure stands beside its node: above, unless the error on other sessions is drawn just there."""
    other = step.relative_error_validation
    crowded = other is not None and 0 < y(step.relative_error) - y(other) < LABEL_HEIGHT
    return 17.0 if crowded else -8.0


def _two_lines(label: str, slot: float) -> list[str]:
    """A label broken at a hyphen or a space where it would not fit its slot (about 6 units a letter)."""
    room = max(int(slot / 5.6), 4)
    if len(label) <= room:
        return [label]
    cut = max(label.rfind("-", 0, room), label.rfind(" ", 0, room)) + 1 or room
    rest = label[cut:].strip()
    return [label[:cut].strip(), rest if len(rest) <= room else rest[: room - 1] + "…"]
