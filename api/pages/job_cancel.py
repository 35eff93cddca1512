"""The cancel button beside the progress of a job."""

from fastapi import APIRouter, Request
from fastapi.responses import Response

from api.pages.rendering import PREFIX
from api.service import access

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.post("/jobs/{job}/cancel")
def cancel_job(request: Request, _user: access.Operator, job: str) -> Response:
    """Cancel a job; the progress, which asks for itself again, says so. Raises 404 or 409 as the service does."""
    access.service_of(request).jobs.cancel(job)
    return Response(status_code=204)
