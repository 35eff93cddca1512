"""Uploaded tables in other dialects than the contract's: which columns are taken as what."""

from __future__ import annotations

import numpy as np
import pytest

from api.service.session_table import rewrite_by_contract
from identify.recording import InputError, Joint, Robot


def robot(*kinds: str) -> Robot:
    joints = tuple(
        Joint(name=f"j{k}", type=kind, alpha=0.0, d=0.0, theta=0.0, r=0.0, drive_gain=1.0)  # type: ignore[arg-type]
        for k, kind in enumerate(kinds)
    )
    return Robot(gravity=(0.0, 0.0, -9.81), joints=joints)


TURNS = robot("revolute")
T = np.arange(100)


@pytest.fixture
def table(tmp_path):
    def of(header: str, *columns: np.ndarray):
        path = tmp_path / "session-01.csv"
        rows = [
            ";".join(f"{value:.6g}".replace(".", ",") for value in row) for row in zip(*columns, strict=True)
        ]
        path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        return path

    return of


def written(path) -> tuple[list[str], np.ndarray]:
    header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    return header, np.loadtxt(path, delimiter=",", skiprows=1)


def test_a_table_of_the_contract_is_left_as_it_is(tmp_path):
    path = tmp_path / "session-01.csv"
    path.write_text("t,q1,v1\n" + "".join(f"{k / 100},{k},{k}\n" for k in range(100)))
    before = path.read_bytes()
    assert rewrite_by_contract(path, TURNS) == ()
    assert path.read_bytes() == before


def test_columns_in_other_units_and_further_ones_are_rewritten(table, tmp_path):
    path = table("t [ms];q1 [deg];v1 [mA];temp1;loudness", 10 * T, 1.8 * T, 500 + T, 20 + 0 * T, 3 * T)
    remarks = rewrite_by_contract(path, TURNS)
    assert any("deg -> rad" in remark for remark in remarks)
    header, values = written(path)
    assert header == ["t", "q1", "v1", "temp1", "loudness"]
    np.testing.assert_allclose(values[:, 0] - values[0, 0], T / 100, atol=1e-9)
    np.testing.assert_allclose(values[:, 1], np.deg2rad(1.8 * T), rtol=1e-6)
    np.testing.assert_allclose(values[:, 2], (500 + T) / 1000, rtol=1e-6)
    np.testing.assert_allclose(values[:, 4], 3 * T)
    assert [each.name for each in tmp_path.iterdir()] == ["session-01.csv"]


def test_a_column_of_words_is_not_kept(table):
    path = table("t [ms];q1 [deg];v1 [mA]", 10 * T, 1.8 * T, 500 + T)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([f"{lines[0]};state", *(f"{line};ok" for line in lines[1:])]) + "\n")
    rewrite_by_contract(path, TURNS)
    assert written(path)[0] == ["t", "q1", "v1"]


@pytest.mark.parametrize("header", ["t [ms];q1 [deg];x", "t [ms];q1 [deg];v1;v2", "s;q1;v1"])
def test_a_table_that_lacks_a_column_of_the_contract_or_has_a_further_joint_s_is_refused(table, header):
    columns = [T] * len(header.split(";"))
    with pytest.raises(InputError):
        rewrite_by_contract(table(header, *columns), TURNS)


def test_a_slide_is_in_metres(table):
    path = table("t [ms];q1 [mm];v1 [mA]", 10 * T, 1.8 * T, 500 + T)
    rewrite_by_contract(path, robot("prismatic"))
    np.testing.assert_allclose(written(path)[1][:, 1], 1.8e-3 * T, rtol=1e-6)
