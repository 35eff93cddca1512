"""Write docs/paper-and-product.md: the paper's tables beside what `identify` finds on the simulated RX130L
joint 3.

    PYTHONPATH=. python docs/make_paper_and_product.py

Every figure of the document comes from the paper's text (constants below) or from the run itself. The plant
is the forward simulation of `tests/plants/rx130l_joint3.py`, which shares nothing with `identify`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import identify
from identify.identification import Identification
from tests.plants.rx130l_joint3 import NOMINAL_SPEED, PAYLOAD_MASSES, Rx130lJoint3, write_experiment

DOCUMENT = Path(__file__).with_name("paper-and-product.md")
FIGURES = {"usual": "paper-and-product-usual.png", "load-velocity": "paper-and-product-load-velocity.png"}
PLANT = Rx130lJoint3(declared_gain_error=-0.06)
GAIN = 1.0 + PLANT.declared_gain_error
SEED = 1

# name in the paper: (name in the product, value, twice the standard deviation, relative deviation in per
# cent)
TABLE_I = {
    "J": ("ZZ1R", 30.921, 0.283, 0.46),
    "MX": ("MX1", 21.109, 0.016, 0.04),
    "M_ae/M_aw": ("mass_ratio", 0.922, 0.003, 0.15),
    "F_C": ("FC1", 39.890, 0.084, 0.11),
    "F_V": ("FV1", 29.429, 0.395, 0.67),
    "tau_off": ("offset1", 9.931, 0.077, 0.39),
}
TABLE_II = {
    "a_m J": ("a_m·ZZ1R", 32.420, 0.262, 0.40),
    "a_m MX": ("a_m·MX1", 22.204, 0.033, 0.07),
    "b_m MX": ("b_m·MX1", 1.621, 0.050, 1.55),
    "a_m": ("a_m", 0.942, 0.005, 0.25),
    "b_m": ("b_m", 0.240, 0.008, 1.72),
    "a_g J": ("a_g·ZZ1R", 29.294, 0.276, 0.47),
    "a_g MX": ("a_g·MX1", 19.432, 0.042, 0.11),
    "b_g MX": ("b_g·MX1", 1.798, 0.051, 1.43),
    "a_g": ("a_g", 0.915, 0.005, 0.27),
    "b_g": ("b_g", 0.266, 0.008, 1.59),
    "c_m": ("c_m", 21.152, 0.143, 0.34),
    "c_g": ("c_g", 15.588, 0.244, 0.78),
    "F_V": ("FV1", 48.139, 0.317, 0.33),
    "tau_off": ("offset1", 9.950, 0.051, 0.26),
}
TABLE_III = {
    "all samples": (0.0733, 0.0484),
    "low velocities": (0.0737, 0.0401),
    "high velocities": (0.0863, 0.0881),
}
TABLE_IV = {"with payload variations": (0.0733, 0.0484), "without payload": (0.0742, 0.0598)}


def truth() -> dict[str, float]:
    """What Table II would hold for the plant, seen through the declared drive gain."""
    p = PLANT
    products = {
        "a_m J": p.a_m * p.inertia,
        "a_m MX": p.a_m * p.first_moment_x,
        "b_m MX": p.b_m * p.first_moment_x,
        "a_m": p.a_m,
        "b_m": p.b_m,
        "a_g J": p.a_g * p.inertia,
        "a_g MX": p.a_g * p.first_moment_x,
        "b_g MX": p.b_g * p.first_moment_x,
        "a_g": p.a_g,
        "b_g": p.b_g,
        "c_m": p.c_m,
        "c_g": p.c_g,
        "F_V": p.viscous,
        "tau_off": p.offset,
    }
    return {name: GAIN * value for name, value in products.items()}


def table(header: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def figure(value: float | None, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def parameter_table(paper: dict, result: Identification, true: dict[str, float]) -> str:
    """Paper, product and, where the model has a true value, the plant."""
    found = {parameter.name: parameter for parameter in result.parameters}
    rows = []
    for name, (own, value, twice, percent) in paper.items():
        # the usual model estimates one ratio for each payload; the paper has one for both
        names = [known for known in found if known == own or known.startswith(own + "[")]
        for known in names or [None]:
            parameter = found[known] if known else None
            product = ["eliminated", "–", "–", "–"]
            if parameter is not None:
                robust = None if parameter.std_robust is None else 2 * parameter.std_robust
                classical = None if parameter.std is None else 2 * parameter.std
                relative = parameter.relative_std_percent
                product = [figure(parameter.value), figure(classical), figure(robust), figure(relative, 2)]
            label = f"`{name}`" + (f" ({known.split('[')[1][:-1]})" if known and "[" in known else "")
            rows.append(
                [label, figure(value), figure(twice), figure(percent, 2), *product, figure(true.get(name))]
            )
    header = ["", "paper", "2σ", "%σ", "product", "2σ", "2σ robust", "%σ", "plant × 0.94"]
    return table(header, rows)


def errors_by_speed(result: Identification) -> list[float]:
    """Relative errors on all, slow (0-10 % of the highest speed) and fast samples (35-100 %), as in Table
    III.
    """
    sessions = [entry.file for entry in result.experiment.sessions if entry.role == "identification"]
    parts = [result.prediction(file, "j3") for file in sessions]
    used = [part.moving for part in parts]
    speed = np.abs(np.concatenate([part.velocity[mask] for part, mask in zip(parts, used, strict=True)]))
    measured = np.concatenate([part.measured[mask] for part, mask in zip(parts, used, strict=True)])
    residual = np.concatenate([part.residual[mask] for part, mask in zip(parts, used, strict=True)])
    top = speed.max()
    chosen = (speed >= 0, speed < 0.1 * top, speed > 0.35 * top)
    return [float(np.linalg.norm(residual[mask]) / np.linalg.norm(measured[mask])) for mask in chosen]


def draw(result: Identification, file: Path) -> None:
    """Measured and predicted torque and their difference in every session: the paper's Fig. 4 or 5."""
    sessions = [entry.file for entry in result.experiment.sessions if entry.role == "identification"]
    axes = plt.subplots(len(sessions), 1, figsize=(10, 2.3 * len(sessions)), sharex=True)[1]
    for axis, session, mass in zip(axes, sessions, PAYLOAD_MASSES, strict=True):
        part = result.prediction(session, "j3")
        axis.plot(part.time, part.measured, color="#1f4e79", linewidth=0.9, label="measured")
        axis.plot(part.time, part.predicted, color="#d1662b", linewidth=0.9, label="predicted")
        axis.plot(part.time, part.residual, color="#6b6b6b", linewidth=0.7, label="difference")
        axis.set_ylabel(f"{mass:g} kg: N m")
        axis.grid(alpha=0.3)
    axes[0].legend(loc="upper right", ncols=3, fontsize=8)
    axes[-1].set_xlabel("time, s")
    axes[0].figure.tight_layout()
    axes[0].figure.savefig(file, dpi=90)
    plt.close(axes[0].figure)


def stribeck_velocity(result: Identification) -> float | None:
    """The constant that the search found for the linear form, rad/s."""
    found = [dict(term.constants or ()).get("stribeck_velocity") for term in result.fitted.model.terms]
    return next((value for value in found if value), None)


def main() -> None:
    """Simulate, identify, write."""
    with tempfile.TemporaryDirectory() as scratch:
        write_experiment(Path(scratch), PLANT, seed=SEED)
        experiment = identify.load_experiment(scratch)
        bare = replace_sessions(scratch)
        results = {
            model: {
                "all": identify.identify(experiment, model, essential=model == "load-velocity"),
                "bare": identify.identify(bare, model),
            }
            for model in FIGURES
        }
        for model, file in FIGURES.items():
            draw(results[model]["all"], DOCUMENT.with_name(file))
        DOCUMENT.write_text(document(results), encoding="utf-8")


def replace_sessions(folder: str) -> identify.Experiment:
    """The same record with the session without payload alone."""
    text = Path(folder, "experiment.yaml").read_text()
    kept = [
        line
        for line in text.splitlines()
        if "file: session-01" not in line and "file: session-02" not in line
    ]
    bare = Path(folder, "bare")
    bare.mkdir()
    (bare / "experiment.yaml").write_text("\n".join(kept) + "\n")
    (bare / "session-00.csv").write_bytes(Path(folder, "session-00.csv").read_bytes())
    return identify.load_experiment(bare)


def document(results: dict) -> str:
    """The text around the numbers."""
    usual, new = results["usual"]["all"], results["load-velocity"]["all"]
    by_speed = {model: errors_by_speed(found["all"]) for model, found in results.items()}
    bare = {model: errors_by_speed(found["bare"])[0] for model, found in results.items()}
    third = [
        [
            words,
            *(f"{value:.4f}" for value in paper),
            f"{by_speed['usual'][k]:.4f}",
            f"{by_speed['load-velocity'][k]:.4f}",
        ]
        for k, (words, paper) in enumerate(TABLE_III.items())
    ]
    own = ((by_speed["usual"][0], by_speed["load-velocity"][0]), (bare["usual"], bare["load-velocity"]))
    fourth = [
        [words, *(f"{value:.4f}" for value in paper), *(f"{value:.4f}" for value in pair)]
        for (words, paper), pair in zip(TABLE_IV.items(), own, strict=True)
    ]
    structured = identify_structured(new)
    fall = [100 * (1 - by_speed["load-velocity"][k] / by_speed["usual"][k]) for k in range(3)]
    velocity = stribeck_velocity(new)
    return TEXT.format(
        stamp="PYTHONPATH=. python docs/make_paper_and_product.py",
        gain=f"{GAIN:g}",
        top=f"{NOMINAL_SPEED:g}",
        table_1=parameter_table(
            TABLE_I, usual, {"J": GAIN * PLANT.inertia, "MX": GAIN * PLANT.first_moment_x}
        ),
        table_2=parameter_table(TABLE_II, new, truth()),
        eliminated=eliminated(new),
        velocity="–" if velocity is None else f"{velocity:.4f}",
        true_velocity=f"{PLANT.stribeck_velocity:g}",
        structured=structured,
        table_3=table(["", "paper, usual", "paper, new", "product, usual", "product, load-velocity"], third),
        table_4=table(["", "paper, usual", "paper, new", "product, usual", "product, load-velocity"], fourth),
        fall_all=f"{fall[0]:.0f}",
        fall_low=f"{fall[1]:.0f}",
        fall_high=f"{fall[2]:.0f}",
        figure_usual=FIGURES["usual"],
        figure_new=FIGURES["load-velocity"],
    )


def eliminated(result: Identification) -> str:
    """Names of the parameters that the elimination took out, in its order."""
    names = [f"`{entry.name}`" for entry in result.document().eliminated]
    return ", ".join(names) or "none"


def identify_structured(result: Identification) -> str:
    """The structured estimate beside the plant."""
    p = PLANT
    true = {
        "ZZ1R": p.inertia,
        "MX1": p.first_moment_x,
        "FV1": GAIN * p.viscous,
        "offset1": GAIN * p.offset,
        "MY1": p.first_moment_y,
        **{
            name: GAIN * getattr(p, name) for name in ["a_m", "b_m", "c_m", "d_m", "a_g", "b_g", "c_g", "d_g"]
        },
    }
    rows = []
    for parameter in result.document().structured.parameters:
        robust = parameter.std_robust
        rows.append(
            [
                f"`{parameter.name}`",
                figure(parameter.value, 4),
                figure(None if robust is None else 2 * robust, 4),
                figure(true.get(parameter.name), 4),
                parameter.unit,
            ]
        )
    return table(["", "product", "2σ robust", "plant", "unit"], rows)


TEXT = """# The paper and the product, side by side

The paper: P. Hamon, M. Gautier, P. Garrec, *Dynamic Identification of Robots with a Dry Friction Model Depending on
Load and Velocity* (equation numbers are its).
The product: `coulomb identify` on a simulated joint 3 of the Stäubli RX130L (`tests/plants/rx130l_joint3.py`), a
forward simulation of eq. (25) with stick and slip, payloads of 0, 3.4584 and 6.970 kg at 1.277 m, three sessions of
60 s at 1 kHz, up to {top} rad/s. It shares no line with `identify`.

This page is written by `{stamp}`; every figure of the product was computed in that run.

**Two robots, not one.** The paper's arm is a real one and its record is not public. The plant is an arm whose
numbers are made from Table II, with one inertia and one first moment. Table II itself has two of each:
a_m J / a_m = 34.4 and a_g J / a_g = 32.0 kg m²; a_m MX / a_m = 23.6 and a_g MX / a_g = 21.2 kg m. No single load
explains that, so no simulation of eq. (25) can return every figure of Table II. With the paper we compare structure:
which parameters are found, how well, which model is better where. With the plant, which is known exactly, we compare
every value.

**The drive gain.** In the paper M_ae/M_aw = 0.922, and a_m and a_g both lie below 1. Friction alone makes
a_m > 1 > a_g. Both fit a drive gain that is some 6 % too small, so the experiment here declares {gain} times the
plant's true gain. The column *plant × {gain}* is what an exact identification through that gain returns.

## Table I: the usual model, eq. (35)

{table_1}

- J, MX and the offset lie where the paper's do. Each payload has a ratio of its own here, where the paper estimates one
  for both.
- F_C and F_V are what this model makes of a friction that it cannot express: averages over the motion. The plant's
  trajectory spends its time at other speeds and loads than the paper's, so these differ more than the rest. They
  are also what changes most between the paper's own tables (F_V from 29.4 to 48.1). The usual model's friction has no
  true value, hence none in the last column.
- The classical 2σ of eq. (13)-(15) takes the residuals as white. Here they are the friction that the model lacks,
  far from white, and the classical figure is too small; *2σ robust* holds for coloured residuals.

## Table II: friction by load and velocity, eq. (30)

{table_2}

Eliminated as not significant: {eliminated}.
The paper eliminated eight of its twenty-two: the four products with MY, b_m J, b_g J, d_m and d_g.

Stribeck velocity found by search: {velocity} rad/s; the plant's is {true_velocity} (the paper settled on 0.03 by
hand).

- In the paper b_m MX / b_m = 6.75 kg m, while a_m MX / a_m = 23.6 kg m: at low speed the payload's load friction is
  more than three times that of the arm's own weight. Eq. (30) knows one load, and so does the plant; hence its b_m MX lies
  above the paper's and its b_m below.
- The fourteen numbers describe ten physical ones. The structured estimate below has one value for each.

### Structured estimate: one value for each physical parameter

{structured}

J and MX are those of the plant itself, not times {gain}: the payloads' declared masses set the scale of the load, and
the error of the drive gain goes into the friction's coefficients. Payloads that are all wrong by the same factor would look
the same.

## Table III: relative error by speed

{table_3}

Low is below 10 % of the highest speed, high above 35 %. The new model lowers the error by {fall_all} % over all
samples (paper: 34 %), by {fall_low} % at low speed (paper: 46 %) and by {fall_high} % at high speed (paper: not at
all).

- The product's errors are smaller throughout, because the plant has nothing but eq. (25), encoder counts, noise and a
  ripple of 1.5 N m. A real arm has more: at high velocities neither of the paper's models gets below 8.6 %.
- At high speed the paper's two models are equal, and here they are not. What the usual model lacks there is
  a_m ≠ a_g. In the paper that part is hidden below what both models lack.

## Table IV: with and without payloads

{table_4}

The second row is fitted on, and judged on, the session without payload alone. As in the paper the new model wins even
there, since gravity alone changes the load.

## Fig. 4 and 5: measured, predicted, difference

Usual model:

![usual model]({figure_usual})

Load and velocity:

![load-velocity model]({figure_new})
"""


if __name__ == "__main__":
    main()
