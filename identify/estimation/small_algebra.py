"""Many small matrices: threads inside the linear algebra library only get into each other's way."""

import os
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

THREADS_BY_ENVIRONMENT = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables by which the linear algebra libraries of NumPy's builds are told their threads when they are loaded."""


def single_threaded(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Run a function with one thread in the linear algebra library.

    The matrices here have tens to hundreds of columns; on two cores a diagnosis takes half the processor time with
    one thread, and two of them run beside each other. A process whose environment says one thread (the command
    `coulomb`) has nothing to limit, and looking through all its loaded libraries for that takes a hundredth of `identify`.
    """

    @wraps(function)
    def limited(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        if all(os.environ.get(name) == "1" for name in THREADS_BY_ENVIRONMENT):
            return function(*args, **kwargs)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
