"""A client of the service for notebooks and scripts.

    from api.client import Client

    with Client("http://localhost:8000", token="coulomb_…") as coulomb:
        for experiment in coulomb.experiments():
            print(experiment.id, coulomb.results(experiment.id).relative_error)
        job = coulomb.add_effect("rx130l-joint3", "load-friction-asymmetric", "j3")
        coulomb.wait(job, print)
        time, signals = coulomb.model_signals("rx130l-joint3", "m2", "session-00", points=2000)

SI units, joint space. Answers are the documents that REST describes.
Every refusal of the service is a `ServiceError` with its words.
"""

from api.client.client import Client
from api.client.connection import ServiceError
from api.client.jobs import JobFailed

__all__ = ["Client", "JobFailed", "ServiceError"]
