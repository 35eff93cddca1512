"""The REST calls to read and to try: the OpenAPI document as a page of the service's own, that asks no other host."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.layout import frame
from api.pages.rendering import page
from api.pages.rest_calls import calls_by_subject, descriptions
from api.service import access

router = APIRouter(include_in_schema=False)


@router.get("/docs")
def rest_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """All calls with their roles, examples and documents; a call that is tried is sent as the one who is signed in."""
    document = request.app.openapi()
    known = descriptions(document)
    return page(
        request,
        "rest.html",
        **frame(request, user, "rest"),
        subjects=calls_by_subject(document),
        descriptions=known,
        described={each.name for each in known},
        version=document["info"]["version"],
    )
