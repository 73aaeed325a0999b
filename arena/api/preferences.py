"""POST /api/v1/preferences: how somebody votes, kept on the account."""

from __future__ import annotations

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField
from arena.services.preferences import keep_voting


class PreferencesBody(StrictSerializer):
    """What changes; what is missing stays as it is."""

    single_keys = FlagField(required=False)
    legend = FlagField(required=False)
    keep_zoom = FlagField(required=False)
    keys = serializers.DictField(child=TextField(max_length=8), required=False)


class PreferencesView(ApiView):
    """The preferences of the one who is signed in."""

    def post(self, request: Request) -> Response:
        """Keep them, and answer with all of them as they are now."""
        body = PreferencesBody(data=request.data)
        body.is_valid(raise_exception=True)
        switches = dict(body.validated_data)
        keys = switches.pop("keys", None)
        user: User = request.user  # type: ignore[assignment]
        return Response(keep_voting(user=user, switches=switches, keys=keys).as_json())
