"""A parameter that was taken out of a model because the data do not show it."""

from dataclasses import dataclass

from identify.results.identification import EliminatedParameter


@dataclass(frozen=True)
class Elimination:
    """A parameter that was taken out, and what it cost.

    column                  : its column of W
    relative_std            : std_robust over value when it was taken out
    error_before, _after    : ‖Y − Wχ‖ / ‖Y‖ with it and without it
    """

    column: int
    relative_std: float
    error_before: float
    error_after: float

    def document(self, name: str, joint: str) -> EliminatedParameter:
        """Its entry in the document of an identification."""
        return EliminatedParameter(
            name=name,
            joint=joint,
            relative_std_percent=100 * self.relative_std,
            relative_error_before=self.error_before,
            relative_error_after=self.error_after,
        )
