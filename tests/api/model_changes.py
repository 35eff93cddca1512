"""Changes of an experiment's models through the service, and what it says of them."""


def change(client, experiment, call, finished, **body):
    """Make a call that starts a job and wait for the job."""
    answer = client.post(f"/experiments/{experiment}/{call}", json=body or None)
    assert answer.status_code == 202, answer.text
    assert answer.headers["Location"] == f"/jobs/{answer.json()['id']}"
    job = finished(client, answer.json())
    assert job["state"] == "done", job
    return job


def results(client, experiment):
    answer = client.get(f"/experiments/{experiment}/results")
    assert answer.status_code == 200, answer.text
    return answer.json()
