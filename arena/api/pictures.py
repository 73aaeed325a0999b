"""Pictures: for staff by what they belong to, for experts by the token of a showing."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.http import Http404, HttpResponse
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from rest_framework.permissions import BasePermission
from rest_framework.request import Request
from rest_framework.views import APIView

from arena.api.access import StaffOnly
from arena.api.files import PNG, FileView, describe_file
from arena.queries.people import role_of
from arena.queries.showings import picture_shown
from augment.models import Augmentation, Scenario


class ExpertsAndAdmins(BasePermission):
    """Experts see what is shown to them; admins all that is shown."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account looks at pairs."""
        return role_of(request.user) in ("expert", "admin")


class ShownPictureView(FileView):
    """A picture of a pair, by its token: the last part of what `a`, `b` and `original` say."""

    permission_classes = (ExpertsAndAdmins,)
    is_never_cached = True

    @describe_file("A picture of a pair", types=[PNG], name="getShownPicture")
    def get(self, request: Request, token: str) -> HttpResponseBase:
        """Neither its name nor an ETag goes with it: they would tell what was made together."""
        return picture_named(picture_shown(user=cast(User, request.user), token=token))


class ScenarioPictureView(FileView):
    """The scene of a scenario before any change."""

    permission_classes = (StaffOnly,)
    is_never_cached = True

    @describe_file("The scene before any change", types=[PNG], name="getScenarioPicture")
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """Nothing before it was drawn."""
        rows = Scenario.objects.only("original_image")
        return picture_named(get_object_or_404(rows, code=code).original_image)


class AugmentationPictureView(FileView):
    """The scene as an augmentation changed it."""

    permission_classes = (StaffOnly,)
    is_never_cached = True

    @describe_file("The changed scene", types=[PNG], name="getAugmentationPicture")
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """Nothing before it was drawn."""
        rows = Augmentation.objects.only("image")
        return picture_named(get_object_or_404(rows, code=code).image)


def picture_named(name: str) -> HttpResponse:
    """The stored picture of that name, 404 before it is drawn."""
    if not name or not default_storage.exists(name):
        raise Http404
    with default_storage.open(name) as file:
        return HttpResponse(file.read(), content_type=PNG)
