"""The session that moves a rig, and who operates and watches the rig, in words."""

from api.pages.number_format import listing
from api.service.payload_sessions import MOVING, ActiveSession
from api.service.service import Service


def moving_session(service: Service) -> ActiveSession | None:
    """The first session that is armed or running."""
    for rig in service.rigs.files():
        active = service.sessions.active(rig)
        if active is not None and active.state in MOVING:
            return active
    return None


def onlooker_words(service: Service, rig: str, own_name: str) -> str:
    """Who has the rig and who looks on, the reader left out."""
    operator = service.rigs.operator(rig)
    others = [name for name in service.rigs.onlookers(rig) if name != own_name]
    words = []
    if operator and operator != own_name:
        words.append(f"{operator} has the rig")
    if others:
        words.append(f"{listing(others)} {'looks' if len(others) == 1 else 'look'} on")
    return " · ".join(words)
