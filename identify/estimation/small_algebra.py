"""Many small matrices: threads inside the linear algebra library only get into each other's way."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def single_threaded(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Run a function with one thread in the linear algebra library.

    The matrices here have tens to hundreds of columns; on two cores a diagnosis takes half the processor time with
    one thread, and two of them run beside each other.
    """

    @wraps(function)
    def limited(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
