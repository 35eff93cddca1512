"""What the routes declare, looked up before a request's body is listened to."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fastapi import params
from fastapi.routing import APIRoute, iter_route_contexts
from starlette.routing import BaseRoute, compile_path

from api.service.access import declared_role
from api.service.accounts import Role


@dataclass(frozen=True)
class DeclaredRoute:
    """A route.

    path       : with its parameters' names in braces
    role       : that it needs; None where it answers without a sign-in
    takes_file : whether a file is uploaded
    """

    methods: frozenset[str]
    path: str
    pattern: re.Pattern[str]
    role: Role | None
    takes_file: bool


class RouteTable:
    """All routes of an application, in the order in which they are tried."""

    def __init__(self, routes: Sequence[BaseRoute]) -> None:
        self._routes = [
            _declared(context)
            for context in iter_route_contexts(routes)
            if isinstance(context.original_route, APIRoute)
        ]

    def find(self, method: str, path: str) -> DeclaredRoute | None:
        """The route that answers, or None where none does."""
        for route in self._routes:
            if method in route.methods and route.pattern.match(path):
                return route
        return None


def _declared(context: Any) -> DeclaredRoute:
    role = declared_role(context)
    fields = context.dependant.body_params
    return DeclaredRoute(
        frozenset(context.methods or ()),
        context.path,
        compile_path(context.path)[0],
        None if role is None else Role(role),
        any(isinstance(field.field_info, params.File) for field in fields),
    )
