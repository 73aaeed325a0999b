"""Ready texts for experts who have not begun or fell behind: to be copied, or sent by mail."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from typing import cast
from urllib.parse import quote

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils import timezone
from django.utils.translation import get_language, ngettext, override
from django.utils.translation import gettext as _
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_POST

from arena.errors import ArenaError
from arena.models import Study
from arena.queries.invitations import expert_lines
from arena.queries.profiles import language_of
from arena.queries.reminders import Lag, SlowExpert, slow_experts
from arena.services.prospects import GUESSES, usual_seconds
from arena.services.reminders import remind
from arena.web.access import ADMIN, allow_only
from augment.errors import AugmentError
from augment.services.wording import translate


@dataclass(frozen=True, slots=True, kw_only=True)
class Reminder:
    """One text.

    Attributes:
        mailto: Opens a mail with subject and text; to nobody where no address is known.
    """

    name: str
    email: str
    subject: str
    text: str

    @property
    def mailto(self) -> str:
        """The address of a link."""
        return f"mailto:{quote(self.email)}?subject={quote(self.subject)}&body={quote(self.text)}"


@allow_only(ADMIN)
@never_cache
@require_POST
def write_reminders(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Texts for one slow expert or for all, each with a new link; shown this once."""
    study = get_object_or_404(Study, code=code)
    wanted = request.POST.get("expert")
    slow = [
        one
        for one in slow_experts(study, expert_lines(study, timezone.now()), timezone.now())
        if not wanted or str(one.line.tally.expert.person.code) == wanted
    ]
    if not slow:
        messages.info(request, _("Nobody has to be reminded; no link was made."))
        return redirect("experts", code=code)
    try:
        links = remind(
            study=study,
            experts=[one.line.tally.expert for one in slow],
            actor=cast(User, request.user),
        )
    except (ArenaError, AugmentError) as error:
        messages.error(request, translate(error))
        return redirect("experts", code=code)
    usual = usual_seconds(study) or usual_seconds() or float(GUESSES["seconds"])
    found = [
        _reminder(
            study,
            one,
            address=request.build_absolute_uri(reverse("invitation", args=[link.token])),
            usual_s=usual,
        )
        for one, link in zip(slow, links, strict=True)
    ]
    context = {
        "study": study,
        "reminders": found,
        "emails": ", ".join(one.email for one in found if one.email),
        "texts": "\n\n---\n\n".join(one.text for one in found),
    }
    return render(request, "studies/reminders.html", context)


def _reminder(study: Study, one: SlowExpert, *, address: str, usual_s: float) -> Reminder:
    """In the language that the expert chose, else in that of whoever writes."""
    expert, tally = one.line.tally.expert, one.line.tally
    seconds = one.line.seconds_per_vote or usual_s
    with override(language_of(expert) or get_language()):
        minutes = max(1, round(tally.left * seconds / 60))
        values: dict[str, object] = {
            "name": expert.get_full_name() or tally.pseudonym,
            "study": study.name,
            "done": tally.voted + tally.skips,
            "total": tally.total,
            "link": address,
            "minutes": ngettext("%(n)s minute", "%(n)s minutes", minutes) % {"n": minutes},
        }
        left = ngettext("%(n)s pair waits", "%(n)s pairs wait", tally.left)
        begun = (
            _("you have not begun yet with “%(study)s”.")
            if one.lag is Lag.NOT_BEGUN
            else _("you have judged %(done)s of %(total)s pairs of “%(study)s”; thank you.")
        )
        values |= {"pairs": left % {"n": tally.left}, "begun": begun % values}
        text = _(
            "Hello %(name)s,\n\n%(begun)s %(pairs)s for you, about %(minutes)s. You can stop "
            "whenever you like: every vote is saved at once.\n\nYour personal link, for you "
            "alone:\n%(link)s\n"
        )
        return Reminder(
            name=str(values["name"]),
            email=expert.email,
            subject=_("Your pairs of “%(study)s”") % values,
            text=text % values,
        )
