"""Accounts, and the links that let their owners in."""

from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from rest_framework import serializers

from arena.api import access, fields, views
from arena.people.links import accept, find_invitation, make_link_path
from arena.people.services import accept_welcome, create_person, end_of_link, make_first_admin
from arena.shell.accounts import ROLES, role_given, top_role

DAYS = 30
"""Lifetime of the token that a link is exchanged for."""


class NewPersonDocument(serializers.Serializer[Any]):
    """A new account."""

    code = serializers.UUIDField(source="person.code")
    username = serializers.CharField()
    pseudonym = serializers.CharField(source="person.pseudonym")
    role = serializers.SerializerMethodField()
    is_active = serializers.BooleanField()
    has_password = serializers.BooleanField(source="has_usable_password")
    link = serializers.CharField(
        help_text="Lets its owner in, or `POST /welcome` make a token; all but experts set a "
        "password by it, once."
    )

    def get_role(self, user: User) -> str | None:
        """Return the role that the account was given."""
        return role_given(user)


class PersonBody(fields.StrictSerializer):
    """A new account."""

    username = fields.TextField(max_length=150)
    role = serializers.ChoiceField(choices=list(ROLES))
    pseudonym = fields.TextField(
        max_length=60, required=False, default=None, help_text="What others see."
    )


class FirstBody(fields.StrictSerializer):
    """The first admin."""

    link = fields.TextField(max_length=2000, help_text="As `serve` printed it, or the end of it.")
    username = fields.TextField(max_length=150)
    password = fields.TextField(max_length=500, trim_whitespace=False)


class WelcomeBody(fields.StrictSerializer):
    """The link of an account, and its password unless it is an expert's."""

    link = fields.TextField(max_length=2000, help_text="As it was given, or the end of it.")
    password = fields.TextField(
        max_length=500, trim_whitespace=False, required=False, help_text="Experts need none."
    )


class TokenDocument(serializers.Serializer[Any]):
    """A new token; it can't be read again."""

    token = serializers.CharField()
    role = serializers.CharField()
    expires_at = serializers.DateTimeField()


class PeopleView(views.ApiView):
    """Accounts."""

    writers = access.ADMINS

    @views.operation(NewPersonDocument, takes=PersonBody, status=201, name="createPerson")
    def post(self, params: views.Params) -> User:
        """Make an account and the link that lets its owner in.

        The link is shown this once.
        """
        made = create_person(**params, password=None, actor=self.user)
        path = make_link_path(made, actor=self.user)
        made.link = self.request.build_absolute_uri(path)  # type: ignore[attr-defined]
        return made


class FirstView(views.ApiView):
    """The first admin of an empty installation."""

    authentication_classes = ()
    permission_classes = ()

    @views.operation(TokenDocument, takes=FirstBody, status=201, name="makeFirstAdmin")
    def post(self, params: views.Params) -> dict[str, Any]:
        """Make the first admin by the link that `serve` prints.

        Answers with a token of the new admin.
        """
        user = make_first_admin(
            code=params["link"], username=params["username"], password=params["password"]
        )
        return _token(user, "first start")


class WelcomeView(views.ApiView):
    """The owner of a new account, who has a link."""

    authentication_classes = ()
    permission_classes = ()

    @views.operation(TokenDocument, takes=WelcomeBody, status=201, name="acceptWelcome")
    def post(self, params: views.Params) -> dict[str, Any]:
        """Exchange the link of an account for a token in its role.

        Anybody but an expert sets a password by it.
        """
        end = end_of_link(params["link"])
        with transaction.atomic():  # the link stays valid where no token can be made
            if find_invitation(end) is not None:
                return _token(accept(token=end).expert, "welcome")
            user = accept_welcome(token=end, password=params.get("password", ""))
            return _token(user, "welcome")


# --- Private -----------------------------------------------------------------------------------


def _token(user: User, name: str) -> dict[str, Any]:
    role = top_role(user) or ""
    fresh = access.make_api_token(owner=user, name=name, role=role, days=DAYS)
    return {"token": fresh.secret, "role": role, "expires_at": fresh.token.expires_at}
