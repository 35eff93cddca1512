"""The FastAPI application: routes and pages on one running service."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi.routing import APIRoute, APIWebSocketRoute, iter_route_contexts
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.sessions import SessionMiddleware

from api.pages import router as pages
from api.pages import static_content
from api.pages.figures_ahead import FiguresAhead
from api.request_head import OriginForm
from api.service.access import declared_role
from api.service.cookie import COOKIE, cookie_key
from api.service.guard import Guard
from api.service.openapi import install_openapi
from api.service.problems import install_problem_handlers
from api.service.request_body import FORM
from api.service.route_table import RouteTable
from api.service.routes import accounts as account_routes
from api.service.routes import audit as audit_routes
from api.service.routes import diagnoses as diagnosis_routes
from api.service.routes import drive_tables as drive_table_routes
from api.service.routes import experiments as experiment_routes
from api.service.routes import jobs as job_routes
from api.service.routes import live as live_routes
from api.service.routes import model_use as model_use_routes
from api.service.routes import models as model_routes
from api.service.routes import plans as plan_routes
from api.service.routes import proofs as proof_routes
from api.service.routes import recordings as recording_routes
from api.service.routes import records as record_routes
from api.service.routes import rigs as rig_routes
from api.service.routes import sessions as session_routes
from api.service.service import create_service
from api.service.settings import ServiceSettings
from api.service.stop_requests import StopRequests
from daq.recording_file import software_version
from identify.recording.errors import InputError

DESCRIPTION = (
    "Measure a robot joint, identify its model, and learn which physical effect the model misses. "
    "SI units, joint space."
)


def create_application(settings: ServiceSettings) -> FastAPI:
    """The application of `coulomb serve`.

    Raises InputError if it would listen beyond this machine without accounts, or if the data folder or the
    database cannot be used.
    """
    service = create_service(settings)
    if settings.trusted_proxies and not service.accounts.exist():
        raise InputError(
            "--trusted-proxy: others reach the service through it and nobody has an account yet; "
            "create one first: coulomb users add NAME --role admin"
        )
    if not settings.bound_to_loopback and not service.accounts.exist():
        raise InputError(
            f"--host {settings.host}: others would reach the service and nobody has an account yet; "
            "create one first: coulomb users add NAME --role admin"
        )

    figures = FiguresAhead(service.experiments)

    @asynccontextmanager
    async def lifespan(_application: FastAPI) -> AsyncIterator[None]:
        service.loop_pulse.start()
        service.stop_readiness.depend_on("event loop", service.loop_pulse)
        service.stop_passes.keep_up_to_date(service.accounts.let_in)
        await run_in_threadpool(service.experiments.reindex)
        service.disk.start()
        service.jobs.listen(figures.job_changed)
        service.jobs.start()
        figures.start()
        service.live.start()
        yield
        # The robot first: it comes to rest before anything else is given up.
        await run_in_threadpool(service.homings.close)
        await run_in_threadpool(service.sessions.close)
        await service.live.close()
        await run_in_threadpool(service.jobs.close)
        await run_in_threadpool(figures.close)
        service.stop_readiness.no_longer("event loop")
        service.loop_pulse.end()
        service.stop_passes.end()
        await run_in_threadpool(service.stop_log.close)
        service.disk.close()
        service.database.close()

    application = FastAPI(
        title="coulomb",
        description=DESCRIPTION,
        version=software_version(),
        lifespan=lifespan,
        openapi_url=None,  # openapi.py answers there, to who may ask
        form_limits=FORM,
        docs_url=None,  # pages/rest_page.py: FastAPI's own loads scripts from another host
        redoc_url=None,
        middleware=[
            Middleware(OriginForm),
            Middleware(
                SessionMiddleware,
                secret_key=cookie_key(settings.data_folder),
                session_cookie=COOKIE,
                max_age=int(settings.sign_in_lasts),
                same_site="lax",
                https_only=settings.secure_cookies,
            ),
            Middleware(Guard),
        ],
    )
    application.state.service = service
    application.state.stop_port = None  # of the stop's own door, where there is one
    application.state.stop_requests = StopRequests(
        service.rig_stop, service.stop_passes, service.stop_log, settings
    )
    install_problem_handlers(application)
    application.include_router(static_content.router)
    for routes in (
        account_routes,
        experiment_routes,
        record_routes,
        model_routes,
        model_use_routes,
        proof_routes,
        drive_table_routes,
        diagnosis_routes,
        job_routes,
        audit_routes,
        rig_routes,
        plan_routes,
        session_routes,
        recording_routes,
        live_routes,
    ):
        application.include_router(routes.router)
    install_openapi(application)
    application.include_router(pages.router)
    application.state.problem_page = pages.problem_page
    _refuse_undeclared_routes(application)
    application.state.route_table = RouteTable(application.routes)
    return application


def _refuse_undeclared_routes(application: FastAPI) -> None:
    """A route without a declared role would be open to everybody: a mistake found at the start, not by a
    stranger."""
    for route in iter_route_contexts(application.routes):
        if (
            isinstance(route.original_route, APIRoute | APIWebSocketRoute)
            and declared_role(route) == "undeclared"
        ):
            raise RuntimeError(f"route {route.path} does not say which role it needs (api/service/access.py)")
