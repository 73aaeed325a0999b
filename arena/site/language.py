"""The language of a page: voters are asked in German or English, all else is English."""

from collections.abc import Callable
from typing import Any

from django.http import HttpRequest
from django.middleware.locale import LocaleMiddleware
from django.utils import translation

from arena.shell.accounts import Language

VOTER_VIEWS = frozenset(
    {
        *("home", "login", "logout", "language", "theme"),
        *("invitation", "enrol", "welcome", "password", "api-tokens", "api-token-revoke"),
        *("vote", "vote-practice", "vote-skipped"),
        *("api-matchups", "api-preferences", "api-reports", "api-votes"),
    }
)
"""Names of the addresses that voters meet; their texts are in the catalogue."""


class VoterLanguageMiddleware(LocaleMiddleware):
    """Django's choice of the language for what voters meet, English for every other view."""

    def process_view(
        self, request: HttpRequest, view: Callable[..., Any], args: Any, kwargs: Any
    ) -> None:
        """Undo the choice where the view is none of the voters'."""
        match = request.resolver_match
        if match is None or match.view_name not in VOTER_VIEWS:
            use_english(request)


def use_english(request: HttpRequest) -> None:
    """Answer this request in English and offer no other language on its page."""
    translation.activate(Language.EN)
    request.is_english_only = True  # type: ignore[attr-defined]
