"""The scale of this service's lab."""

from threading import Lock

from api.service.problems import Problem
from drivers.errors import ScaleError


class WeighingScale:
    """The scale on one serial port, one request at a time; no port means that masses are typed."""

    def __init__(self, port: str | None) -> None:
        self._port = port
        self._lock = Lock()

    def weigh(self) -> float:
        """The stable weight in kg.

        Raises the problem 409 where there is no scale, and 503 with what to do if it gives no weight.
        """
        if self._port is None:
            raise Problem(409, "No scale is set up (coulomb serve --scale PORT); type the mass.")
        from drivers.scale import Scale

        with self._lock:
            try:
                with Scale(self._port) as scale:
                    return scale.weigh().mass
            except ScaleError as error:
                raise Problem(503, f"{error}. Try again, or type the mass.") from error
