"""The frame of every page: who looks at it and where they can go."""

from __future__ import annotations

from dataclasses import dataclass

from django import template
from django.http import HttpRequest
from django.template.context import Context
from django.urls import reverse
from django.utils.functional import Promise
from django.utils.translation import gettext_lazy as _

from arena.people.queries import Profile, profile_of

register = template.Library()


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """One entry of the navigation."""

    label: str
    url: str
    is_current: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Shell:
    """What the frame needs to know; without a profile nobody is signed in."""

    profile: Profile | None
    links: list[Link]


_SECTIONS: dict[str, tuple[Promise, frozenset[str]]] = {
    "home": (_("Home"), frozenset({""})),
    "scenarios": (_("Scenarios"), frozenset({"scenarios", "scenes", "uploads"})),
    "contestants": (_("Contestants"), frozenset({"contestants", "endpoints", "models"})),
    "jobs": (_("Jobs"), frozenset({"jobs", "augmentations", "drives"})),
    "studies": (_("Studies"), frozenset({"studies"})),
    "people": (_("People"), frozenset({"people", "audit"})),
}
"""Labels, and with which words the addresses of their pages begin."""
_MENU = {
    "expert": ("home",),
    "analyst": ("home", "scenarios", "contestants", "jobs", "studies"),
    "admin": ("home", "scenarios", "contestants", "jobs", "studies", "people"),
}


@register.simple_tag(takes_context=True)
def shell(context: Context) -> Shell:
    """Profile and navigation of whoever made the request."""
    request: HttpRequest | None = context.get("request")
    user = getattr(request, "user", None)
    profile = profile_of(user) if user is not None else None
    if request is None or profile is None or profile.role is None:
        return Shell(profile=profile, links=[])
    match = request.resolver_match
    here = match.route.partition("/")[0] if match else None
    return Shell(
        profile=profile,
        links=[
            Link(
                label=str(_SECTIONS[name][0]),
                url=reverse(name),
                is_current=here in _SECTIONS[name][1],
            )
            for name in _MENU[profile.role]
        ],
    )
