"""Motion and exports on the pages: asked for by a button, shown with figures and certificates in words."""

import re

import pytest

from api.pages.figures.step_chart import ModelStep, draw_step_chart


def computed(client, finished, address):
    """Ask for it, and wait for the job that the answer follows."""
    answer = client.post(address)
    assert answer.status_code == 200, answer.text
    (job,) = set(re.findall(r"job=([0-9a-f]+)", answer.text))
    assert finished(client, {"id": job, "state": "queued"})["state"] == "done"
    return answer.text


def with_gains(client, experiment, gains):
    address = f"/pages/experiments/{experiment}/use/simulation?version=m1"
    files = None if gains is None else {"gains": ("gains.yaml", gains)}
    return client.post(address, data={"driven_by": "file"}, files=files)


def test_motion_is_predicted_when_asked_for_and_stands_beside_the_torque(imported_short, finished):
    client, experiment = imported_short
    address = f"/pages/experiments/{experiment}/model"
    assert "Predict motion" in client.get(address).text
    asked = computed(client, finished, f"/pages/experiments/{experiment}/use/simulation?version=m1")
    assert "Predicting motion" in asked
    text = client.get(address).text
    assert "1 s ahead, motion that the fit did not see (" in text
    assert " mrad</td>" in text
    assert "Driven by the recorded torque." in text
    assert "free run from the start, sessions of the fit" in text
    assert "Motion over time" in text
    assert "leaves the record" in text
    # windows of one's own, and what cannot be one
    use = f"/pages/experiments/{experiment}/use/simulation?version=m1"
    refused = client.post(use, data={"horizons": "0,1"})
    assert refused.status_code == 422
    assert refused.json()["detail"].startswith("“0” is not a time ahead; enter seconds above zero")
    asked = client.post(use, data={"horizons": "0.2; 0.5"})
    (job,) = set(re.findall(r"job=([0-9a-f]+)", asked.text))
    assert set(re.findall(r"job=([0-9a-f]+)", client.post(use, data={"horizons": "0.2, 0.5"}).text)) == {job}
    # the page that is loaded anew meanwhile goes on following it, and it can be cancelled there
    assert client.post(f"/pages/jobs/{job}/cancel").status_code == 204
    assert finished(client, {"id": job, "state": "queued"})["state"] == "cancelled"
    ended = client.get(f"/pages/experiments/{experiment}/use/progress?job={job}").text
    assert "The motion was not predicted: cancelled" in ended
    # in closed loop, if it can be: this record has no reference, and its drive was not asked
    answer = client.post(
        f"/pages/experiments/{experiment}/use/simulation?version=m1", data={"driven_by": "drives"}
    )
    (job,) = set(re.findall(r"job=([0-9a-f]+)", answer.text))
    failed = finished(client, {"id": job, "state": "queued"})
    assert failed["state"] == "failed"
    words = "the loop cannot be closed with the gains of the drives: no recording holds any"
    assert failed["words"] == words
    for _ in range(2):  # and it stays there
        assert f"data-motion-fault>The last prediction was not made: {words}" in client.get(address).text
    assert with_gains(client, experiment, None).json()["detail"].startswith("Choose the file with")
    refused = with_gains(client, experiment, "joints: 5\n")
    assert refused.status_code == 422
    assert refused.json()["detail"] == "gains.yaml line 1: joints: must be a list, [...], not 5."
    beside = client.post(use, data={"driven_by": "torque"}, files={"gains": ("gains.yaml", "joints: 5\n")})
    assert beside.status_code == 422
    assert beside.json()["detail"] == "Choose “gains from a file”, or take the file gains.yaml away."
    answer = with_gains(client, experiment, "joints:\n  - {joint: j1, position: 1.0, velocity: 0.5}\n")
    (job,) = set(re.findall(r"job=([0-9a-f]+)", answer.text))
    assert "no column 'qref1' with the reference" in finished(client, {"id": job, "state": "queued"})["words"]
    # the staircase of the models has the error of motion too
    assert " mrad</text>" in client.get(f"/pages/experiments/{experiment}/missing").text


def test_an_export_is_made_when_asked_for_and_can_be_taken_with_its_certificate(imported, finished):
    client, experiment = imported
    address = f"/pages/experiments/{experiment}/results"
    assert "Make Python</button>" in client.get(address).text
    use = f"/pages/experiments/{experiment}/use/exports/py?version=m1"
    computed(client, finished, use)
    text = client.get(address).text
    assert "Checked with the module, run by a Python interpreter of its own." in text
    assert "everything kept" in text
    taken = client.get(use)
    assert taken.headers["content-disposition"] == f'attachment; filename="{experiment}-m1.py"'
    assert "def torque(" in taken.text
    assert client.get(use.replace("/py", "/urdf")).status_code == 404
    # what all formats say alike is said once
    assert "data-export-remarks" not in text
    computed(client, finished, use.replace("/py", "/json"))
    text = client.get(address).text
    assert text.count("Payload-mass was estimated beside the model") == 1
    assert "data-export-remarks" in text


@pytest.mark.parametrize("worse", [True, False])
def test_the_staircase_marks_a_step_whose_motion_is_worse(worse):
    steps = [
        ModelStep("usual", 0.04, motion="1.34 mrad"),
        ModelStep("+ x", 0.03, motion="1.5 mrad", motion_worse=worse),
    ]
    drawn = draw_step_chart(steps, None)
    assert ("1.5 mrad ↑" in drawn) == worse
    assert "1.34 mrad" in drawn
    assert "position 1 s ahead, unseen motion, rms" in drawn
    alone = draw_step_chart([ModelStep("usual", 0.04)], None)
    assert "mrad" not in alone
    assert "1 s ahead" not in alone
