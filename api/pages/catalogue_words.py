"""The catalogue of effects as the pages quote it: names as a person says them, equation, explanation, source."""

import re
from functools import cache

from identify.effects import catalogue as effects
from identify.effects.picture import PictureVariable, picture_over
from identify.results.effect import CatalogueEffect


@cache
def catalogue() -> dict[str, CatalogueEffect]:
    """Entry of `coulomb effects` by the effect's name."""
    return {entry.effect: entry for entry in effects.catalogue()}


def entry_of(effect: str) -> CatalogueEffect | None:
    """The entry of an effect; None for a user's own that the catalogue does not list."""
    return catalogue().get(effect)


@cache
def effect_titles() -> dict[str, str]:
    """Name -> words for a sentence."""
    return {name: entry.title for name, entry in catalogue().items()}


@cache
def _effects_by_parameter() -> dict[str, str]:
    """Name of a parameter, without the joint's number -> the effect that it belongs to."""
    return {each.name: effect for effect, one in effects.effects().items() for each in one.parameters}


def picture_of(effect: str, variable: str | None = None) -> PictureVariable:
    """The picture's variable of an effect of the catalogue; for a user's own that of `variable`, speed if None."""
    known = effects.effects().get(effect.split("@")[0])
    return picture_over(variable) if known is None else known.picture


def effect_of_parameter(name: str) -> str:
    """The effect that a parameter belongs to; empty for one that the catalogue does not know."""
    stem = re.match(r"[^\[]*?(?=\d*(?:\[|$))", name)
    return _effects_by_parameter().get(stem[0] if stem else name, "")
