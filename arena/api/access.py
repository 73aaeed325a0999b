"""Which roles may use which resource."""

from __future__ import annotations

from rest_framework.permissions import BasePermission
from rest_framework.request import Request
from rest_framework.views import APIView

from arena.queries.people import role_of


class StaffOnly(BasePermission):
    """Admins and analysts; experts must not learn who took part in what."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may know of jobs."""
        return role_of(request.user) in ("admin", "analyst")


class ExpertsOnly(BasePermission):
    """Experts; who has become an admin or analyst may know too much to go on voting."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account votes."""
        return role_of(request.user) == "expert"
