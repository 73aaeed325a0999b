"""Voting keys, and the voting page's settings of a person."""

from django.contrib.auth.models import User

from arena.models import Person

KEYS: dict[str, tuple[str, ...]] = {
    "a": ("1", "a"),
    "e": ("2", "e"),
    "b": ("3", "b"),
    "both_miss": ("4", "n"),
    "undo": ("u",),
    "skip": ("s",),
    "report": ("r",),
    "comment": ("c",),
    "tools": ("t",),
    "why": ("w",),
    "original": ("o",),
    "zoom": ("z",),
    "reset": ("0",),
    "ruler": ("m",),
    "blink": ("x",),
    "difference": ("v",),
    "replay": ("d",),
    "play": ("p",),
    "back": (",", "j"),
    "on": (".", "k"),
    "rate": ("f",),
    "rings": ("g",),
    "legend": ("l",),
    "help": ("h", "?"),
}
"""Action -> the single keys that do it, the one that is shown first."""

SWITCHES: dict[str, bool] = {
    "single_keys": True,
    "legend": True,
    "rings": True,
    "keep_zoom": False,
}
"""What can be on or off, and how it is at first."""


def voting_switches(user: User) -> dict[str, bool]:
    """Return every one of SWITCHES as the person has set it."""
    person = Person.objects.filter(user=user).only("preferences").first()
    switches = person.preferences.get("voting", {}) if person else {}
    return {name: bool(switches.get(name, usual)) for name, usual in SWITCHES.items()}
