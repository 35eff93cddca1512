"""Mass and inertia that MuJoCo's compiler gives to shapes, against MuJoCo."""

import mujoco
import numpy as np
import pytest

from identify.dynamics.geometry import Geometry
from identify.dynamics.mjcf_shapes import SIZES, Solid, body_of
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.urdf import read_urdf
from identify.recording.errors import InputError

INERTIAL = '<inertial pos="0.1 0 0" mass="3" diaginertia="0.1 0.1 0.1"/>'
OF_MESH = '<geom type="mesh" mesh="m"/>'


def words(values):
    return " ".join(f"{value:.6f}" for value in values)


def shape(generator, kind):
    """A solid of a kind, with its size, place, mass and class in one of the ways that MJCF has."""
    size = words(generator.uniform(0.02, 0.2, SIZES[kind]))
    if kind not in ("sphere", "ellipsoid") and generator.random() < 0.5:
        where = f'fromto="{words(generator.uniform(-0.3, 0.3, 6))}"'
        size = size.split()[0]
    else:
        where = (
            f'pos="{words(generator.uniform(-0.3, 0.3, 3))}" euler="{words(generator.uniform(-90, 90, 3))}"'
        )
    weight = ("", 'mass="1.5"', 'density="250"', 'class="light"')[generator.integers(4)]
    return f'<geom type="{kind}" size="{size}" {where} {weight}/>'


def arm(path, seed, compiler="", upper=""):
    """Two bodies of all kinds of solids."""
    generator = np.random.default_rng(seed)
    shapes = ["".join(shape(generator, kind) for kind in SIZES) for _body in range(2)]
    path.write_text(
        f"<mujoco><compiler {compiler}/><default><geom density='700'/><default class='light'><geom density='90'/></default>"
        f"</default><worldbody><body name='upper'><joint name='j1' axis='0 1 0'/>{upper}{shapes[0]}"
        f"<geom type='plane' size='1 1 1'/><geom size='0.1' mass='0'/><geom size='0.1' group='3'/>"
        f"<body pos='.3 0 0'><joint name='j2' axis='0 0 1'/>{shapes[1]}</body></body></worldbody></mujoco>"
    )
    return path


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    ("compiler", "upper"),
    [
        ("", ""),
        ("", INERTIAL),
        ('inertiafromgeom="true"', INERTIAL),
        ('inertiagrouprange="0 2"', ""),
        ('inertiagrouprange="0 3"', ""),
    ],
)
def test_torques_with_inertias_of_shapes_are_mujocos(tmp_path, seed, compiler, upper):
    path = arm(tmp_path / "arm.xml", seed, compiler, upper)
    read = read_urdf(path)
    assert read.remarks == ()
    model = mujoco.MjModel.from_xml_string(path.read_text().replace("<geom type='plane' size='1 1 1'/>", ""))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = np.random.default_rng(seed).normal(size=(3, 2))
    mujoco.mj_inverse(model, data)
    columns = standard_regressor(
        Geometry.from_robot(read.robot), data.qpos[None], data.qvel[None], data.qacc[None]
    )
    np.testing.assert_allclose((columns @ read.standard)[0], data.qfrc_inverse, rtol=1e-9, atol=1e-9)


def test_two_light_spheres_on_a_rod_have_the_inertia_of_a_dumb_bell():
    def ball(x, mass):
        place = np.eye(4)
        place[0, 3] = x
        return Solid("sphere", np.array([0.05]), place, mass, 0.0)

    mass, centre, inertia = body_of([ball(0.1, 0.02), ball(0.4, 0.01)])
    assert mass == pytest.approx(0.03)
    assert centre == pytest.approx([0.2, 0.0, 0.0])
    own = 2 / 5 * 0.03 * 0.05**2
    apart = 0.02 * 0.01 / 0.03 * 0.3**2  # reduced mass times distance squared
    assert inertia == pytest.approx(np.diag([own, own + apart, own + apart]), rel=1e-12, abs=1e-18)


def test_solids_without_mass_make_a_body_without_any():
    mass, centre, inertia = body_of([Solid("box", np.ones(3), np.eye(4), 0.0, 0.0)])
    assert (mass, centre.tolist(), inertia.any()) == (0.0, [0.0, 0.0, 0.0], False)


def test_a_shape_whose_inertia_is_not_known_is_said(tmp_path):
    (tmp_path / "a.xml").write_text(
        f'<mujoco><worldbody><body name="b"><joint name="j"/>{OF_MESH}</body></worldbody></mujoco>'
    )
    (remark,) = read_urdf(tmp_path / "a.xml").remarks
    assert "'b, geom 1' is a mesh" in remark
    assert "mj_saveLastXML" in remark


@pytest.mark.parametrize(
    ("geom", "compiler", "said"),
    [
        ('<geom type="box" size="0.1 0.1"/>', "", "'b, geom 1': size '0.1 0.1' must be 3 numbers"),
        ('<geom type="capsule" size="0.1" fromto="0 0 0 0 0 0"/>', "", "fromto has no length"),
        ("<geom/>", "", "'b, geom 1': size '' must be a number"),
        ('<geom size="1"/>', 'settotalmass="3"', "settotalmass> is not read; let MuJoCo"),
    ],
)
def test_a_shape_that_cannot_be_read_is_refused_by_its_name(tmp_path, geom, compiler, said):
    (tmp_path / "a.xml").write_text(
        f'<mujoco><compiler {compiler}/><worldbody><body name="b"><joint name="j"/>{geom}</body></worldbody></mujoco>'
    )
    with pytest.raises(InputError) as refused:
        read_urdf(tmp_path / "a.xml")
    assert said in str(refused.value)
