"""Accounts: who I am, who there is, and links that let somebody in."""

from __future__ import annotations

from typing import Any, cast

from django.contrib.auth.models import User
from django.db import transaction
from django.urls import reverse
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.models import ApiToken, Person
from arena.queries.people import ROLES, role_given, role_of
from arena.services.accounts import (
    accept_welcome,
    check_password_strength,
    make_welcome_token,
)
from arena.services.api_tokens import FreshToken, make_api_token
from arena.services.first_start import make_first_admin
from arena.services.people import create_person

DAYS = 30
"""How long the token works that a link is exchanged for."""


class AccountDocument(serializers.Serializer[Any]):
    """Whoever asks."""

    username = serializers.CharField()
    pseudonym = serializers.CharField()
    role = serializers.CharField(
        allow_null=True, help_text="That of the token where one is used; null without one."
    )
    token_expires_at = serializers.DateTimeField(allow_null=True)


class PersonDocument(serializers.Serializer[Any]):
    """One account."""

    code = serializers.UUIDField()
    username = serializers.CharField()
    pseudonym = serializers.CharField()
    role = serializers.CharField(allow_null=True)
    is_active = serializers.BooleanField()
    has_password = serializers.BooleanField()


class NewPersonDocument(PersonDocument):
    """An account just made."""

    link = serializers.CharField(
        help_text="Lets its owner set a password, or `POST /welcome` make a token; works once."
    )


class PersonBody(StrictSerializer):
    """A new account."""

    username = TextField(max_length=150)
    role = serializers.ChoiceField(choices=list(ROLES))
    pseudonym = TextField(max_length=60, required=False, help_text="What others see.")


class FirstBody(StrictSerializer):
    """The first admin."""

    link = TextField(max_length=2000, help_text="As `serve` printed it, or the end of it.")
    username = TextField(max_length=150)
    password = TextField(max_length=500, trim_whitespace=False)


class WelcomeBody(StrictSerializer):
    """Whoever got a link sets their password."""

    link = TextField(max_length=2000, help_text="As it was given, or the end of it.")
    password = TextField(max_length=500, trim_whitespace=False)


class TokenDocument(serializers.Serializer[Any]):
    """A token just made; it can't be read again."""

    token = serializers.CharField()
    role = serializers.CharField()
    expires_at = serializers.DateTimeField()


class AccountView(ApiView):
    """Whoever asks."""

    @describe("Who asks", answers=AccountDocument, name="getAccount")
    def get(self, request: Request) -> Response:
        """The account and the role that it has here."""
        user = cast(User, request.user)
        token = request.auth if isinstance(request.auth, ApiToken) else None
        found = {
            "username": user.get_username(),
            "pseudonym": user.person.pseudonym,
            "role": role_of(user),
            "token_expires_at": token and token.expires_at,
        }
        return Response(AccountDocument(found).data)


class PeopleView(ApiView):
    """Accounts, but those that the machine votes for."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Accounts, by when they were made",
        answers=page_of(PersonDocument),
        query=PageQuery,
        name="listPeople",
    )
    def get(self, request: Request) -> Response:
        """A page of them."""
        rows = Person.objects.filter(is_simulated=False).select_related("user")
        found = rows.prefetch_related("user__groups")
        query = read_query(request, PageQuery)
        return answer_page(
            request,
            found,
            query,
            PersonDocument,
            lines=lambda page: [_person(p.user) for p in page],
        )

    @describe(
        "Make an account and the link that lets its owner in",
        takes=PersonBody,
        answers=NewPersonDocument,
        status=201,
        name="createPerson",
    )
    def post(self, request: Request) -> Response:
        """As on the page; the link is shown this once."""
        body = PersonBody(data=request.data)
        body.is_valid(raise_exception=True)
        actor = cast(User, request.user)
        given = body.validated_data
        made = create_person(
            username=given["username"],
            password=None,
            role=given["role"],
            pseudonym=given.get("pseudonym") or None,
            actor=actor,
        )
        link = reverse("welcome", args=[make_welcome_token(made, actor=actor)])
        found = _person(made) | {"link": request.build_absolute_uri(link)}
        return Response(NewPersonDocument(found).data, status=201)


class FirstView(ApiView):
    """The first admin of an empty installation."""

    authentication_classes = ()
    permission_classes = ()
    is_public = True

    @describe(
        "Make the first admin by the link that `serve` prints",
        takes=FirstBody,
        answers=TokenDocument,
        status=201,
        name="makeFirstAdmin",
    )
    def post(self, request: Request) -> Response:
        """Answers with a token of the new admin."""
        body = FirstBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        check_password_strength(given["password"])
        user = make_first_admin(
            token=_end_of(given["link"]),
            username=given["username"],
            password=given["password"],
        )
        return _token(user, "first start")


class WelcomeView(ApiView):
    """Whoever got a link."""

    authentication_classes = ()
    permission_classes = ()
    is_public = True

    @describe(
        "Set the password of an account by its link",
        takes=WelcomeBody,
        answers=TokenDocument,
        status=201,
        name="acceptWelcome",
    )
    def post(self, request: Request) -> Response:
        """Answers with a token of the account, in its role."""
        body = WelcomeBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        with transaction.atomic():  # who gets no token has a link that still works
            user = accept_welcome(token=_end_of(given["link"]), password=given["password"])
            return _token(user, "welcome")


# --- Private -----------------------------------------------------------------------------------


def _end_of(link: str) -> str:
    return link.strip().rstrip("/").rpartition("/")[2]


def _token(user: User, name: str) -> Response:
    role = role_of(user) or ""
    fresh: FreshToken = make_api_token(owner=user, name=name, role=role, days=DAYS)
    found = {"token": fresh.secret, "role": role, "expires_at": fresh.token.expires_at}
    return Response(TokenDocument(found).data, status=201)


def _person(user: User) -> dict[str, Any]:
    return {
        "code": user.person.code,
        "username": user.get_username(),
        "pseudonym": user.person.pseudonym,
        "role": role_given(user),
        "is_active": user.is_active,
        "has_password": user.has_usable_password(),
    }
