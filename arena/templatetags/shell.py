"""The frame of every page: who looks at it and where they can go."""

from typing import Any

from django import template
from django.http import HttpRequest
from django.template.context import Context
from django.urls import reverse
from django.utils.functional import Promise
from django.utils.translation import gettext_lazy as _

from arena.shell.accounts import frame_profile
from arena.shell.steps import next_step

register = template.Library()


_SECTIONS: dict[str, tuple[Promise, frozenset[str]]] = {
    "home": (_("Home"), frozenset({""})),
    "scenarios": (
        _("Scenarios"),
        frozenset({"scenarios", "scenes", "uploads", "benchmarks", "sweeps"}),
    ),
    "benchmarks": (_("Benchmarks"), frozenset({"benchmarks"})),
    "contestants": (
        _("Contestants"),
        frozenset({"contestants", "endpoints", "models", "submissions"}),
    ),
    "submissions": (_("Submissions"), frozenset({"submissions"})),
    "jobs": (_("Jobs"), frozenset({"jobs", "augmentations", "drives"})),
    "studies": (_("Studies"), frozenset({"studies", "boards"})),
    "people": (_("People"), frozenset({"people", "audit"})),
}
"""Labels, and with which words the addresses of their pages begin."""
_MENU = {
    "expert": ("home",),
    "entrant": ("home", "benchmarks", "submissions"),
    "researcher": ("home", "scenarios", "contestants", "jobs", "studies"),
    "admin": ("home", "scenarios", "contestants", "jobs", "studies", "people"),
}


@register.simple_tag(takes_context=True)
def shell(context: Context) -> dict[str, Any]:
    """Return profile, navigation and the next of the first steps of whoever made the request."""
    request: HttpRequest | None = context.get("request")
    user = getattr(request, "user", None)
    profile = frame_profile(user) if user is not None else None
    if request is None or profile is None or profile.role is None:
        return {"profile": profile, "links": []}
    match = request.resolver_match
    here = match.route.partition("/")[0] if match else None
    links = [
        {"label": label, "url": reverse(name), "is_current": here in beginnings}
        for name, (label, beginnings) in _SECTIONS.items()
        if name in _MENU[profile.role]
    ]
    is_led = profile.role == "admin" and here not in {"", None}  # home lists all of the steps
    return {"profile": profile, "links": links, "next": next_step() if is_led else None}
