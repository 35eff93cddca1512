"""The catalogue of effects: those of this package's files, and those that installed packages add by entry point.

An effect is in the catalogue because its class stands in a file of this package; it is listed nowhere else.
"""

import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from inspect import isabstract
from pathlib import Path

from identify.effects.effect import Effect
from identify.effects.parameter import EffectParameter
from identify.recording.errors import InputError
from identify.results.effect import CatalogueEffect, CatalogueParameter, EffectPicture

ENTRY_POINT_GROUP = "coulomb.effects"

ORDER = (
    *(
        "viscous",
        "coulomb",
        "offset",
        "viscous-asymmetric",
        "viscous-quadratic",
        "viscous-cubic",
        "viscous-power",
    ),
    *("stribeck", "load-friction", "load-friction-asymmetric", "load-stribeck"),
    *("friction-position", "friction-temperature", "friction-warmup", "presliding", "backlash"),
    *(
        "torque-ripple",
        "current-ripple",
        "joint-spring",
        "gain-saturation",
        "drive-gain",
        "delay",
        "elasticity",
    ),
    *("motor-inertia", "coupled-friction", "payload-mass", "payload-com", "gravity-tilt"),
)
"""Names that other people's data rely on, in the order in which they are listed; a new one comes behind them."""

STATED = ("name", "title", "group", "equation", "explanation", "regressors", "parameters", "source")
"""What every effect of the catalogue says of itself."""


@cache
def built_in() -> tuple[Effect, ...]:
    """The effects of this package's own files: those of `ORDER`, then new ones by name."""
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        import_module(f"{__package__}.{module.name}")
    places = {name: place for place, name in enumerate(ORDER)}
    return tuple(
        sorted(_loaded().values(), key=lambda effect: (places.get(effect.name, len(places)), effect.name))
    )


def _loaded() -> dict[str, Effect]:
    """By name, the effects of those of this package's files that are imported already."""
    kinds: list[type[Effect]] = [Effect]
    for kind in kinds:  # grows while it is walked: subclasses of subclasses
        kinds += kind.__subclasses__()
    return {
        kind.name: _only(kind)
        for kind in kinds
        if kind.__module__.startswith(f"{__package__}.") and kind.catalogued and not isabstract(kind)
    }


@cache
def _only(kind: type[Effect]) -> Effect:
    return kind()


@cache
def effects() -> dict[str, Effect]:
    """All effects by name, in the order of the catalogue; installed packages' own come last.

    Raises InputError: an installed package offers what is no effect, or one whose name is taken.
    """
    by_name = dict(_built_in_by_name())
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        offered = _offered(entry)
        if offered.name in by_name:
            raise InputError(
                f"entry point {entry.name}: an effect named '{offered.name}' is already in the catalogue"
            )
        by_name[offered.name] = offered
    return by_name


@cache
def _built_in_by_name() -> dict[str, Effect]:
    return {effect.name: effect for effect in built_in()}


@cache
def _our_own(name: str) -> Effect | None:
    """The effect of that name in this package's files, None where there is none; a diagnosis asks for some thousand times."""
    loaded = _loaded()
    return loaded[name] if name in loaded else _built_in_by_name().get(name)


class KnownEffects(Mapping[str, Effect]):
    """All effects by name, as `effects()`.

    Installed packages are asked only for a name that is not one of our own, or when all are listed: to ask them, the metadata
    of everything that is installed must be read, which takes as long as a third of a fit. Nor are the files of our own
    effects imported for the name of one that is there already: a plain fit has no use for most of them.
    """

    def __getitem__(self, name: str) -> Effect:
        ours = _our_own(name)
        return effects()[name] if ours is None else ours

    def __iter__(self) -> Iterator[str]:
        return iter(effects())

    def __len__(self) -> int:
        return len(effects())


def _offered(entry: EntryPoint) -> Effect:
    """The effect of an installed package.

    Raises InputError: it cannot be loaded, is no effect, or does not say all of itself.
    """
    package = f" of package {entry.dist.name}" if entry.dist else ""
    where = f"entry point {entry.name} = {entry.value}{package}"
    try:
        effect = entry.load()()
    except Exception as error:  # whatever a package's own code raises must name the package
        raise InputError(f"{where}: cannot be loaded ({type(error).__name__}: {error})") from error
    if not isinstance(effect, Effect):
        raise InputError(f"{where}: is no identify.effects.effect.Effect")
    for stated in STATED:
        if not getattr(effect, stated, None):
            raise InputError(f"{where}: says no '{stated}'")
    if not all(isinstance(each, EffectParameter) for each in effect.parameters):
        raise InputError(f"{where}: 'parameters' are to be identify.effects.parameter.EffectParameter")
    return effect


def catalogue() -> list[CatalogueEffect]:
    """The catalogue as documents (the contract's `effects --json`, section 3)."""
    return [
        CatalogueEffect(
            effect=effect.name,
            title=effect.title or effect.name,
            group=effect.group,
            equation=effect.equation,
            explanation=effect.explanation,
            regressors=tuple(effect.regressors),
            parameters=tuple(
                CatalogueParameter(name=each.name, unit=each.unit) for each in effect.parameters
            ),
            needs=tuple(effect.needs),
            source=effect.source,
            picture=EffectPicture(**asdict(effect.picture)),
            indistinguishable_from=tuple(effect.confusable),
        )
        for effect in effects().values()
    ]
