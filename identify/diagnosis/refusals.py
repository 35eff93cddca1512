"""What a search took out and does not add again, as long as that beside which it was taken out is in the model."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field

from identify.effects.model import Term

Key = tuple[str, int]
"""Effect and joint of a term."""


@dataclass
class Refusals:
    """Effects that are not to be added.

    An effect that another took the place of has been wronged if that other one leaves too: then it may come back, once. Each
    comes back once at most, so that a search ends.

    always : for good
    beside : those refused as long as all of these terms of the same joint are in the model
    """

    always: set[Key] = field(default_factory=set)
    beside: dict[Key, frozenset[Key]] = field(default_factory=dict)
    _came_back: set[Key] = field(default_factory=set)

    def refuse(self, term: Term, judged: int, others: Iterable[tuple[Term, int]]) -> None:
        """Refuse a term that was judged on a joint beside the others of that joint."""
        there = frozenset(other.key for other, joint in others if joint == judged and other.key != term.key)
        if there and term.key not in self._came_back:
            self.beside[term.key] = there
        else:
            self.always.add(term.key)

    def present(self, added: Sequence[tuple[Term, int]]) -> Collection[Key]:
        """What is refused beside the terms that are added now."""
        keys = {term.key for term, _ in added}
        for key in [key for key, others in self.beside.items() if not others <= keys]:
            del self.beside[key]
            self._came_back.add(key)
        return self.always | set(self.beside)
