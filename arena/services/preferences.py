"""What a person chooses for themselves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from django.contrib.auth.models import User
from django.db import transaction
from django.utils.translation import gettext as _

from arena.errors import InvalidPreference
from arena.models import Person
from arena.queries.profiles import Language, Theme
from arena.voting.queries.keys import (
    KEY_LABELS,
    SOMETIMES,
    SWITCHES,
    USUAL_KEYS,
    VotingPreferences,
    read_voting,
)


@transaction.atomic
def choose_theme(*, user: User, theme: Theme) -> Person:
    """Keep how the pages look to this account, which becomes a person if it was none."""
    person = _person(user)
    person.preferences = {**person.preferences, "theme": theme.value}
    person.save(update_fields=["preferences"])
    return person


@transaction.atomic
def choose_language(*, user: User, language: Language) -> Person:
    """Keep the language that this account reads, whatever the browser asks for."""
    person = _person(user)
    person.preferences = {**person.preferences, "language": language.value}
    person.save(update_fields=["preferences"])
    return person


@transaction.atomic
def keep_voting(
    *, user: User, switches: Mapping[str, bool], keys: Mapping[str, str] | None = None
) -> VotingPreferences:
    """Keep how this account votes; what is not named stays as it was.

    Args:
        user: Whose preferences they are.
        switches: Some of SWITCHES -> on or off.
        keys: Action -> its only single key; actions that are missing get their usual ones, so an
            empty mapping takes all back. None leaves the keys alone. One of `SOMETIMES` that is
            missing among others keeps its key: the page that was filled in had no such action.

    Raises:
        InvalidPreference: A switch or action is unknown, or keys can't be told apart.
    """
    if unknown := sorted(set(switches) - set(SWITCHES)):
        raise InvalidPreference("switches", f"Unknown: {', '.join(unknown)}.")
    person = _person(user)
    voting = {**person.preferences.get("voting", {}), **switches}
    if keys is not None:
        chosen = _chosen(keys)
        voting["keys"] = chosen | _unseen(voting.get("keys", {}), keys, chosen)
    person.preferences = {**person.preferences, "voting": voting}
    person.save(update_fields=["preferences"])
    return read_voting(person.preferences)


def _person(user: User) -> Person:
    person, _is_new = Person.objects.select_for_update().get_or_create(
        user=user, defaults={"pseudonym": user.get_username()}
    )
    return person


def _unseen(
    before: Mapping[str, str], keys: Mapping[str, str], chosen: Mapping[str, str]
) -> dict[str, str]:
    """The kept keys of actions that the page did not show, unless they are another's now."""
    if not keys:
        return {}
    unseen = [action for action in SOMETIMES if action in before and action not in keys]
    used = {chosen.get(action, usual[0]) for action, usual in USUAL_KEYS.items()}
    return {action: before[action] for action in unseen if before[action] not in used}


def _chosen(keys: Mapping[str, str]) -> dict[str, str]:
    """The keys that are not the usual first ones, in small letters."""
    if unknown := sorted(set(keys) - set(USUAL_KEYS)):
        raise InvalidPreference("keys", f"Unknown action: {', '.join(unknown)}.")
    lower = {action: key.lower() for action, key in keys.items()}
    for action, key in lower.items():
        if len(key) != 1 or not key.isprintable() or key.isspace():
            raise InvalidPreference(
                "keys",
                _("“%(action)s” needs one character, not '%(key)s'.")
                % {"action": _(KEY_LABELS[action]), "key": key},
            )
    shown = {
        action: lower.get(action, usual[0])
        for action, usual in USUAL_KEYS.items()
        if action in lower or action not in SOMETIMES
    }
    for key, times in Counter(shown.values()).items():
        if times > 1:
            both = ", ".join(_(KEY_LABELS[one]) for one, chosen in shown.items() if chosen == key)
            raise InvalidPreference(
                "keys", _("'%(key)s' would do two things: %(both)s.") % {"key": key, "both": both}
            )
    return {action: key for action, key in lower.items() if key != USUAL_KEYS[action][0]}
