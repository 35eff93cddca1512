"""The REST calls to read and to try: the OpenAPI document in Swagger UI, which comes with the service and asks no other host."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.layout import frame
from api.pages.rendering import page
from api.service import access

router = APIRouter(include_in_schema=False)


@router.get("/docs")
def rest_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """All calls with their roles, examples and problems; a call that is tried is sent as the one who is signed in."""
    return page(request, "rest.html", **frame(request, user, "rest"))
