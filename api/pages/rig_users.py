"""Who operates and watches a rig, in words."""

from api.pages.number_format import listing
from api.service.service import Service


def onlooker_words(service: Service, rig: str, own_name: str) -> str:
    """Who operates the rig and who watches it, the reader left out."""
    operator = service.operators.operator(rig)
    others = [name for name in service.operators.onlookers(rig) if name != own_name]
    parts = []
    if operator and operator != own_name:
        parts.append(f"{operator} operates the rig")
    if others:
        parts.append(f"{listing(others)} {'is' if len(others) == 1 else 'are'} watching")
    return " · ".join(parts)
