"""Sign-in, one's own account with its tokens, the users, and the audit log."""

from typing import Annotated

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.form_input import input_errors_as_problems
from api.pages.layout import frame
from api.pages.number_format import utc_time
from api.pages.rendering import PREFIX, page
from api.service import access
from api.service.accounts import Role
from api.service.problems import Problem

router = APIRouter(prefix=PREFIX, include_in_schema=False)

Name = Annotated[str, Form(max_length=64)]
Password = Annotated[str, Form(max_length=1000)]
AUDIT_ROWS = 100


@router.get("/sign-in", dependencies=[access.Public])
def sign_in_page(
    request: Request, then: Annotated[str, Query(max_length=300)] = "", ended: bool = False
) -> HTMLResponse:
    """The form; where nobody has an account yet, how the first one is made.

    ended : whether a page leads here because the sign-in that it was shown to has ended
    """
    context = {"then": then, "ended": ended, "accounts_exist": access.service_of(request).accounts.exist()}
    return page(request, "sign_in.html", **context, csrf=access.masked(access.csrf_token(request)))


@router.post("/sign-in", dependencies=[access.Public])
def sign_in(
    request: Request, name: Name, password: Password, then: Annotated[str, Form(max_length=300)] = ""
) -> Response:
    """Check name and password and go on to the page that was asked for."""
    try:
        access.sign_in(request, name.strip(), password)
    except Problem as problem:
        if problem.status != 401:
            raise
        raise Problem(403, problem.detail) from None  # the 401 of this form must not lead back to this form
    inside = then.startswith(f"{PREFIX}/") and "//" not in then
    return Response(status_code=204, headers={"HX-Redirect": then if inside else f"{PREFIX}/"})


@router.post("/sign-out")
def sign_out(request: Request, _user: access.Viewer) -> Response:
    """End the browser's sign-in."""
    access.sign_out(request)
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/sign-in"})


@router.get("/account")
def account_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """One's own account: tokens for scripts, the password, and the way out."""
    tokens = access.service_of(request).accounts.tokens(user.name)
    rows = [
        {
            "id": token.id,
            "label": token.label,
            "scope": token.scope,
            "expires": utc_time(token.expires),
            "last_used": utc_time(token.last_used),
        }
        for token in tokens
    ]
    scopes = [role for role in Role if user.role.covers(role)]
    return page(request, "account.html", **frame(request, user, "account"), tokens=rows, scopes=scopes)


@router.post("/account/tokens")
def issue_token(
    request: Request,
    user: access.Person,
    label: Annotated[str, Form(min_length=1, max_length=100)],
    scope: Annotated[Role, Form()],
    days: Annotated[float, Form(gt=0, le=366)],
) -> HTMLResponse:
    """Make a token and show it this once."""
    with input_errors_as_problems():
        token = access.service_of(request).accounts.issue_token(
            user.name, label, scope, days * 86400.0, sign_in=request.session.get(access.SIGN_IN_KEY)
        )
    return page(request, "new_token.html", token=token)


@router.post("/account/tokens/{token}/revoke")
def revoke_token(request: Request, user: access.Person, token: str) -> Response:
    """End a token."""
    if not access.service_of(request).accounts.revoke_token(user.name, token):
        raise Problem(404, "This token has expired or was revoked.")
    return Response(headers={"HX-Refresh": "true"})


@router.post("/account/password")
def change_password(request: Request, user: access.Person, old: Password, new: Password) -> Response:
    """Change one's own password; every browser signs in again."""
    service = access.service_of(request)
    checked = access.verify_password(request, user.name, old)
    with input_errors_as_problems():
        service.accounts.change_user(user.name, password=new, by=checked)
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/sign-in"})


@router.get("/users")
def users_page(request: Request, user: access.Administrator) -> HTMLResponse:
    """Everybody who may sign in."""
    users = [
        {"name": row.name, "role": Role(row.role), "created": utc_time(row.created)}
        for row in access.service_of(request).accounts.users()
    ]
    return page(request, "users.html", **frame(request, user, "users"), users=users, roles=list(Role))


@router.post("/users")
def add_user(
    request: Request,
    _user: access.Administrator,
    name: Name,
    password: Password,
    role: Annotated[Role, Form()],
) -> Response:
    """Create a user."""
    with input_errors_as_problems():
        access.service_of(request).accounts.add_user(name.strip(), password, role)
    return Response(headers={"HX-Refresh": "true"})


@router.post("/users/{name}/role")
def change_role(
    request: Request, _user: access.Administrator, name: str, role: Annotated[Role, Form()]
) -> Response:
    """Change somebody's role."""
    with input_errors_as_problems():
        access.service_of(request).accounts.change_user(name, role=role)
    return Response(headers={"HX-Refresh": "true"})


@router.post("/users/{name}/remove")
def remove_user(request: Request, _user: access.Administrator, name: str) -> Response:
    """Remove a user."""
    with input_errors_as_problems():
        access.service_of(request).accounts.remove_user(name)
    return Response(headers={"HX-Refresh": "true"})


@router.get("/audit")
def audit_page(
    request: Request, user: access.Administrator, before: Annotated[int | None, Query(ge=1, le=2**53)] = None
) -> HTMLResponse:
    """The audit log, the newest first."""
    access.service_of(request).stop_log.settle()
    rows = access.service_of(request).audit.rows(before=before, limit=AUDIT_ROWS)
    entries = [
        {
            "id": row.id,
            "time": utc_time(row.time),
            "user": row.user,
            "role": row.role,
            "client": row.client,
            "action": row.action,
            "target": row.target,
            "outcome": row.outcome,
            "refused": not row.outcome.startswith(("2", "3", "asked", "done")),
        }
        for row in rows
    ]
    older = rows[-1].id if len(rows) == AUDIT_ROWS else None
    return page(request, "audit.html", **frame(request, user, "audit"), entries=entries, older=older)
