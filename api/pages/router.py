"""All pages of the service, and what a browser sees when something is wrong."""

from urllib.parse import quote

from fastapi import APIRouter, Request
from fastapi.responses import RedirectResponse, Response

from api.pages import (
    account_pages,
    chosen_samples,
    column_plot,
    drive_tables_page,
    experiments_page,
    job_cancel,
    live_page,
    missing_page,
    model_page,
    proofs_page,
    records_page,
    report,
    rest_page,
    results_page,
    rig_page,
    rival_effects_page,
    run_bar,
    sample_range,
    session_form,
    session_steps,
    sessions_page,
    step_actions,
    urdf_page,
    use_page,
    without_payload_page,
)
from api.pages.rendering import PREFIX, page
from api.service import access
from api.service.problems import Problem

router = APIRouter()
PARTS = (
    account_pages,
    run_bar,
    job_cancel,
    rig_page,
    session_form,
    session_steps,
    live_page,
    experiments_page,
    sessions_page,
    records_page,
    model_page,
    sample_range,
    chosen_samples,
    column_plot,
    missing_page,
    rival_effects_page,
    step_actions,
    results_page,
    proofs_page,
    drive_tables_page,
    report,
    without_payload_page,
    urdf_page,
    use_page,
    rest_page,
)
for part in PARTS:
    router.include_router(part.router)


@router.get("/", include_in_schema=False)
@router.get(PREFIX, include_in_schema=False)
@router.get(f"{PREFIX}/", include_in_schema=False)
def start(request: Request, _user: access.Viewer) -> Response:
    """The service's address leads to the rig; on the first visit, to the ways to a first experiment."""
    known = access.service_of(request).experiments.rows()
    return RedirectResponse(f"{PREFIX}/{'rig' if known else 'experiments'}")


def problem_page(request: Request, problem: Problem) -> Response:
    """An error for a browser: the sign-in page at 401, else one sentence, in the place where htmx asked for it."""
    faults = problem.extra.get("errors", ())
    detail = "; ".join(_field_fault(**each) for each in faults) or problem.detail
    if problem.status == 401:
        address = f"{PREFIX}/sign-in?then={quote(request.url.path)}"
        if "hx-request" in request.headers:
            return Response(status_code=401, headers={"HX-Redirect": address})
        return RedirectResponse(address, status_code=303)
    if "hx-request" in request.headers:
        response = page(request, "problem_message.html", status=problem.status, detail=detail, in_alert=True)
        response.headers["HX-Retarget"] = "#problem"
        response.headers["HX-Reswap"] = "innerHTML"
        return response
    return page(request, "problem.html", status=problem.status, detail=detail, problem_status=problem.status)


def _field_fault(where: str, what: str) -> str:
    """What is wrong with a field, as its form calls it: `seconds: must be greater than 0`."""
    return f"{where.rpartition('.')[2]}: {what.replace('Input should', 'must')}"
