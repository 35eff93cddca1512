"""The identified model as a URDF: bodies that have its base parameters, and its losses as damping and friction."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

import identify
from api.service.identified_urdf import can_be_made, urdf_of, write_identified_urdf
from identify.dynamics.geometry import Geometry
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.urdf import read_urdf
from identify.recording.errors import InputError
from tests.plants.single_joint import record, write_experiment

pytest.importorskip("cvxpy", reason="the extra 'feasible' is not installed")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = record({}, seed=3, duration=8.0, rate=200.0, repeats=1, payload_masses=(0.0,))
    return write_experiment(tmp_path_factory.mktemp("urdf") / "joint", made)


def test_the_file_has_the_identified_base_parameters_and_losses(folder, tmp_path):
    assert can_be_made()
    assert urdf_of(tmp_path) is None
    heard = []
    name = write_identified_urdf(
        lambda done, step: heard.append(done), str(folder), "usual", [], str(tmp_path)
    )
    assert urdf_of(tmp_path) == (tmp_path / name).read_text()
    result = identify.identify(identify.load_experiment(folder), "usual")
    values = {parameter.name: parameter.value for parameter in result.parameters}
    (joint,) = ElementTree.fromstring(urdf_of(tmp_path)).iter("dynamics")
    assert float(joint.get("damping")) == pytest.approx(values["FV1"], rel=1e-5)
    assert float(joint.get("friction")) == pytest.approx(values["FC1"], rel=1e-5)
    read = read_urdf(tmp_path / name)
    q, still = np.linspace(-1.5, 1.5, 9)[:, None], np.zeros((9, 1))
    base = result.fitted.record.body.base
    identified = base.nearest_standard(result.fitted.fit.chi[: len(base)])
    of_file, of_model = (
        standard_regressor(geometry, q, still, still)[:, 0] @ standard
        for geometry, standard in (
            (replace(Geometry.from_robot(read.robot), gravity=base.geometry.gravity), read.standard),
            (base.geometry, identified),
        )
    )
    assert np.abs(of_model).max() > 1.0  # N m of gravity
    assert of_file == pytest.approx(of_model, abs=1e-3 * np.abs(of_model).max())
    assert heard == sorted(heard)
    assert heard[-1] == 0.6


def test_a_model_without_bodies_of_its_own_is_refused(folder, tmp_path):
    with pytest.raises(InputError, match="has no base parameters of its own"):
        write_identified_urdf(lambda done, step: None, str(folder), "load-velocity", [], str(tmp_path))
    assert urdf_of(tmp_path) is None
