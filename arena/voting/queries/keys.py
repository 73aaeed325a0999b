"""Which keys vote for a person, and what else the voting page remembers of them."""

from dataclasses import dataclass
from typing import Any

from django.contrib.auth.models import User
from django.utils.translation import gettext_noop

from arena.models import Person

USUAL_KEYS: dict[str, tuple[str, ...]] = {
    "a": ("1", "a"),
    "e": ("2", "e"),
    "b": ("3", "b"),
    "undo": ("u",),
    "skip": ("s",),
    "report": ("r",),
    "comment": ("c",),
    "original": ("o",),
    "zoom": ("z",),
    "reset": ("0",),
    "ruler": ("m",),
    "blink": ("x",),
    "difference": ("v",),
    "measures": ("g",),
    "text": ("t",),
    "replay": ("d",),
    "legend": ("l",),
    "help": ("h", "?"),
}
"""Action -> the single keys that do it, the one that is shown first."""

KEY_LABELS = {
    "a": gettext_noop("A is better"),
    "e": gettext_noop("Equal"),
    "b": gettext_noop("B is better"),
    "undo": gettext_noop("Undo"),
    "skip": gettext_noop("Skip"),
    "report": gettext_noop("Report"),
    "comment": gettext_noop("Comment"),
    "original": gettext_noop("Original"),
    "zoom": gettext_noop("Zoom"),
    "reset": gettext_noop("Zoom back"),
    "ruler": gettext_noop("Ruler"),
    "blink": gettext_noop("Blink"),
    "difference": gettext_noop("Difference"),
    "measures": gettext_noop("Measures"),
    "text": gettext_noop("Text description"),
    "replay": gettext_noop("Drives"),
    "legend": gettext_noop("Legend"),
    "help": gettext_noop("Help"),
}
"""Action -> what the page calls it, in English."""

SOMETIMES = ("text", "replay", "blink", "difference", "measures")
"""Actions that only some studies have, or that came later than the keys of some accounts: their
usual key gives way to one that was chosen."""

SWITCHES: dict[str, bool] = {"single_keys": True, "legend": True, "keep_zoom": False}
"""What can be on or off, and how it is at first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VotingPreferences:
    """How one person votes.

    Attributes:
        own_keys: Action -> the one key that a person chose instead of the usual ones.
        switches: Every one of SWITCHES -> on or off.
    """

    own_keys: dict[str, str]
    switches: dict[str, bool]

    @property
    def keys(self) -> dict[str, list[str]]:
        """Action -> the keys that do it. A chosen key does nothing else any more.

        One of `SOMETIMES` has none where its usual key was chosen for something else.
        """
        taken = set(self.own_keys.values())
        return {
            action: [self.own_keys[action]]
            if action in self.own_keys
            else [key for key in usual if key not in taken]
            for action, usual in USUAL_KEYS.items()
        }

    def as_json(self) -> dict[str, Any]:
        """For the page and the wire."""
        return {"keys": self.keys, **self.switches}


def voting_preferences(user: User) -> VotingPreferences:
    """What is kept of the person, the usual where nothing is."""
    person = Person.objects.filter(user=user).only("preferences").first()
    return read_voting(person.preferences if person else {})


def read_voting(preferences: dict[str, Any]) -> VotingPreferences:
    """The part of a person's preferences that is about voting."""
    kept = preferences.get("voting", {})
    return VotingPreferences(
        own_keys=dict(kept.get("keys", {})),
        switches={name: bool(kept.get(name, usual)) for name, usual in SWITCHES.items()},
    )
