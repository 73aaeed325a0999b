"""Which roles may use which resource."""

from __future__ import annotations

from rest_framework.permissions import SAFE_METHODS, BasePermission
from rest_framework.request import Request
from rest_framework.views import APIView

from arena.queries.people import role_of


class StaffOnly(BasePermission):
    """Admins and analysts; experts must not learn who took part in what."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may know of jobs."""
        return role_of(request.user) in ("admin", "analyst")


class AdminsOnly(BasePermission):
    """Who launches and changes."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account administrates."""
        return role_of(request.user) == "admin"


class ReadersAndAdmins(BasePermission):
    """Admins and analysts may read, admins alone may change."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may do what it asks for."""
        allowed = ("admin", "analyst") if request.method in SAFE_METHODS else ("admin",)
        return role_of(request.user) in allowed


class ExpertsOnly(BasePermission):
    """Experts; who has become an admin or analyst may know too much to go on voting."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account votes."""
        return role_of(request.user) == "expert"
