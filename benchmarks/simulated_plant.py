"""What a step of the simulated mechanisms costs, beside Pinocchio's articulated-body algorithm on the same
robot.

Run: python -m benchmarks.simulated_plant
Pinocchio (compiled C++) computes one acceleration without friction; a step of ours holds friction that
sticks, motors, heat and the integration of one millisecond.
"""

import math
import time
from collections.abc import Callable

import numpy as np

from daq.rig import Rig
from drivers.simulated.plant import build_mechanism

CYCLE = 1e-3
STEPS = 4000


def cost(work: Callable[[int], object], steps: int = STEPS) -> float:
    """µs of processor time per call, the best of three rounds."""
    rounds = []
    for _ in range(3):
        begin = time.process_time()
        for k in range(steps):
            work(k)
        rounds.append((time.process_time() - begin) / steps * 1e6)
    return min(rounds)


def arm_step(*effects: dict[str, object]) -> Callable[[int], object]:
    """A step of the RX130L's joint 3 under a sinusoidal current that reverses it."""
    section = dict(Rig.load("rx130l-joint3-simulated").simulated or {})["plant"]
    mechanism = build_mechanism({**section, "hidden_effects": list(effects)})
    currents = [np.array([6.0 + 3.0 * math.sin(5e-3 * k)]) for k in range(STEPS)]

    def step(k: int) -> object:
        mechanism.step(currents[k], CYCLE)
        return mechanism.motor_angle

    return step


def robot_step() -> tuple[Callable[[int], object], Callable[[int], object] | None]:
    """A step of the six-axis robot, and Pinocchio's forward dynamics of the same links where it is
    installed.
    """
    section = dict(Rig.load("tx40-simulated").simulated or {})["plant"]
    mechanism = build_mechanism(section)
    phases = 2e-3 * np.arange(STEPS)[:, np.newaxis] * np.array([1.0, 1.2, 1.5, 2.0, 2.3, 2.7])
    currents = np.array([3.0, 5.0, 3.0, 1.0, 1.0, 0.8]) * np.sin(phases)

    def step(k: int) -> object:
        mechanism.step(currents[k], CYCLE)
        return mechanism.motor_angle

    try:
        import pinocchio as pin
    except ImportError:
        return step, None
    model = pin.Model()
    parent = 0
    for j, link in enumerate(section["links"]):
        ca, sa = math.cos(link["alpha"]), math.sin(link["alpha"])
        place = pin.SE3(
            np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]),
            np.array([link["d"], -link["r"] * sa, link["r"] * ca]),
        )
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{j}")
        xx, xy, xz, yy, yz, zz = link["inertia"]
        body = pin.Inertia(
            link["mass"], np.array(link["com"]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        )
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    data = model.createData()
    state = np.random.default_rng(0).standard_normal((3, 6))
    return step, lambda k: pin.aba(model, data, state[0], state[1], state[2])


def main() -> None:
    """Print the table."""
    robot, peer = robot_step()
    rows = [
        ("arm", cost(arm_step()), 25.0),
        (
            "arm with ten hidden effects",
            cost(
                arm_step(
                    {"effect": "joint-spring", "stiffness": 10.0},
                    {"effect": "torque-ripple", "amplitude": 3.0, "order": 40.0},
                    {"effect": "cogging", "amplitude": 2.0, "order": 6.0},
                    {"effect": "current-ripple", "amplitude": 0.02, "order": 2.0},
                    {"effect": "gain-saturation", "limit": 40.0},
                    {"effect": "sticky-spot", "extra": 10.0, "centre": 0.5, "width": 0.1},
                    {"effect": "friction-position", "amplitude": 0.1},
                    {"effect": "stribeck", "extra": 5.0, "velocity": 0.05},
                    {"effect": "friction-warmup", "excess": 0.3, "time_constant": 60.0},
                    {"effect": "viscous-cubic", "coefficient": 2.0},
                )
            ),
            None,
        ),
        ("arm, elastic with backlash",
         cost(arm_step({"effect": "elasticity", "stiffness": 3e5, "damping": 50.0}, {"effect": "backlash", "gap": 1e-4})),
         None),
        ("six axes", cost(robot, 1000), 400.0),
    ]  # fmt: skip
    print(f"{'one step of 1 ms':<32} {'µs':>8} {'aim µs':>8}")
    for name, spent, aim in rows:
        print(f"{name:<32} {spent:8.1f} {'' if aim is None else f'{aim:8.0f}'}")
    if peer is None:
        print("pinocchio is not installed: no peer")
        return
    spent = cost(peer)
    print(f"{'pinocchio aba, one acceleration':<32} {spent:8.1f}")
    print(f"a step of six axes costs {rows[-1][1] / spent:.0f} accelerations of Pinocchio")


if __name__ == "__main__":
    main()
