"""POST /api/v1/preferences: how somebody votes, kept on the account."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField
from arena.api.schema import describe
from arena.services.preferences import keep_voting


class PreferencesBody(StrictSerializer):
    """What changes; what is missing stays as it is."""

    single_keys = FlagField(required=False)
    legend = FlagField(required=False)
    keep_zoom = FlagField(required=False)
    keys = serializers.DictField(child=TextField(max_length=8), required=False)


class PreferencesDocument(serializers.Serializer[Any]):
    """All preferences as they are now."""

    single_keys = serializers.BooleanField()
    legend = serializers.BooleanField()
    keep_zoom = serializers.BooleanField()
    keys = serializers.DictField(
        child=serializers.ListField(child=serializers.CharField()),
        help_text="By action, its keys.",
    )


class PreferencesView(ApiView):
    """The preferences of the one who is signed in."""

    @describe(
        "Keep how one votes",
        takes=PreferencesBody,
        answers=PreferencesDocument,
        name="keepPreferences",
    )
    def post(self, request: Request) -> Response:
        """Keep them, and answer with all of them as they are now."""
        body = PreferencesBody(data=request.data)
        body.is_valid(raise_exception=True)
        switches = dict(body.validated_data)
        keys = switches.pop("keys", None)
        user: User = request.user  # type: ignore[assignment]
        return Response(keep_voting(user=user, switches=switches, keys=keys).as_json())
