"""Results that are kept while they are looked at: fits never change once stored, so what was drawn from them holds."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class LruCache(Generic[Value]):
    """The results used last, by key: as many as weigh no more than `size` together, and always the last one.

    weigh : how much of the size a result takes; one each where left out
    """

    def __init__(self, size: int, weigh: Callable[[Value], int] = lambda _: 1) -> None:
        self._size, self._weigh = size, weigh
        self._results: OrderedDict[Hashable, Value] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The result kept under `key`, else what `make()` returns."""
        with self._lock:
            if key in self._results:
                self._results.move_to_end(key)
                return self._results[key]
        made = make()
        with self._lock:
            self._results[key] = made
            self._results.move_to_end(key)
            weight = sum(self._weigh(each) for each in self._results.values())
            while weight > self._size and len(self._results) > 1:
                weight -= self._weigh(self._results.popitem(last=False)[1])
        return made
