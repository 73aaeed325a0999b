"""Who is author of what, for admins on the page of a study's experts; experts see none of it."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.views.decorators.http import require_POST

from arena.errors import ArenaError
from arena.models import Authorship, Study
from arena.queries.people import by_pseudonym
from arena.services.authorships import mark_author, take_back_author
from arena.site.access import ADMIN, allow_only
from augment.errors import AugmentError


class AuthorForm(forms.Form):
    """Which expert of the study made which of its contestants."""

    expert = forms.ChoiceField(error_messages={"required": "Choose an expert."})
    contestant = forms.ChoiceField(error_messages={"required": "Choose a contestant."})

    def __init__(self, data: dict[str, Any] | None = None, *, study: Study) -> None:
        super().__init__(data)
        self.accounts = {
            str(user.person.code): user
            for user in by_pseudonym(study.experts.select_related("person"))
        }
        named = {
            code: f"{user.person.pseudonym} ({user.get_username()})"
            for code, user in self.accounts.items()
        }
        made = study.contestants.order_by("name", "slug").values_list("slug", "name")
        for name, offered in (("expert", named.items()), ("contestant", made)):
            found = self.fields[name]
            assert isinstance(found, forms.ChoiceField)
            found.choices = [("", "Choose …"), *offered]
            found.widget.attrs["class"] = "input"


@allow_only(ADMIN)
@require_POST
def mark(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Mark an expert as author of a contestant, be the study open or closed."""
    study = get_object_or_404(Study, code=code)
    form = AuthorForm(request.POST, study=study)
    if not form.is_valid():
        for faults in form.errors.values():
            messages.error(request, " ".join(map(str, faults)))
        return redirect("experts", code=code)
    try:
        row = mark_author(
            study=study,
            expert=form.accounts[form.cleaned_data["expert"]],
            contestant=form.cleaned_data["contestant"],
            actor=cast(User, request.user),
        )
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    else:
        named = {"name": row.expert.person.pseudonym, "contestant": row.contestant.name}
        done = "{name} is marked as author of {contestant}.".format(**named)
        messages.success(request, done)
    return redirect("experts", code=code)


@allow_only(ADMIN)
@require_POST
def take_back(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Forget one mark; it stays in the log."""
    rows = Authorship.objects.select_related("study", "expert__person", "contestant")
    row = get_object_or_404(rows, code=code)
    named = {"name": row.expert.person.pseudonym, "contestant": row.contestant.name}
    take_back_author(authorship=row, actor=cast(User, request.user))
    done = "{name} is not marked as author of {contestant} any more.".format(**named)
    messages.success(request, done)
    return redirect("experts", code=row.study.code)
