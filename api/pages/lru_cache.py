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
        self._making: dict[Hashable, threading.Event] = {}
        self._lock = threading.Lock()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The result kept under `key`, else what `make()` returns; who asks while another makes it waits for that."""
        while True:
            with self._lock:
                if key in self._results:
                    self._results.move_to_end(key)
                    return self._results[key]
                by_another = self._making.get(key)
                if by_another is None:
                    made_by_this = self._making[key] = threading.Event()
                    break
            by_another.wait()
        try:
            made = make()
            with self._lock:
                self._keep(key, made)
        finally:
            with self._lock:
                del self._making[key]
            made_by_this.set()
        return made

    def _keep(self, key: Hashable, made: Value) -> None:
        self._results[key] = made
        weight = sum(self._weigh(each) for each in self._results.values())
        while weight > self._size and len(self._results) > 1:
            weight -= self._weigh(self._results.popitem(last=False)[1])
