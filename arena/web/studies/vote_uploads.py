"""Votes from elsewhere, sent as a file by a page: they become a closed study that can be rated."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.core.files.uploadedfile import UploadedFile
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect, render
from django.views.decorators.http import require_http_methods

from arena.errors import ArenaError
from arena.scenarios.services import was_too_large
from arena.services.vote_imports import ImportedVotes, import_votes
from arena.web.access import ADMIN, allow_only
from augment.errors import AugmentError

MOST_MB = 20
"""Some 200,000 votes, read while the page waits; more goes by `manage.py import_votes`."""
_ODD = re.compile(r"[^A-Za-z0-9._ -]+")


class VoteFileForm(forms.Form):
    """A file and what its study is called."""

    name = forms.CharField(max_length=120, strip=True, label="Name of the study")
    file = forms.FileField(
        label="File", allow_empty_file=True, error_messages={"required": "Choose a file."}
    )
    is_simulated = forms.BooleanField(required=False)

    def clean_file(self) -> UploadedFile[bytes]:
        """No larger than a page can wait for."""
        file: UploadedFile[bytes] = self.cleaned_data["file"]
        if (file.size or 0) > MOST_MB * 1_000_000:
            raise forms.ValidationError(_too_large())
        return file


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def upload_votes_page(request: HttpRequest) -> HttpResponse:
    """The form; what can't be read is said with its line, and nothing is kept."""
    form = VoteFileForm(request.POST or None, request.FILES or None)
    if was_too_large(request.META):
        form.is_valid()
        form.errors.pop("file", None)
        form.add_error("file", _too_large())
    elif request.method == "POST" and form.is_valid():
        try:
            imported = _import(form, cast(User, request.user))
        except (ArenaError, AugmentError) as error:
            form.add_error(None, str(error))
        else:
            messages.success(
                request, f"Imported: votes {imported.votes}, contestants {imported.contestants}."
            )
            return redirect("results", code=imported.study.code)
    context = {"form": form, "most_mb": MOST_MB}
    return render(request, "studies/votes.html", context, status=422 if form.errors else 200)


def _import(form: VoteFileForm, actor: User) -> ImportedVotes:
    file: UploadedFile[bytes] = form.cleaned_data["file"]
    with TemporaryDirectory(prefix="arena-votes-") as folder:
        # The reader's errors name the file: as its sender called it, in plain letters.
        path = Path(folder) / (_ODD.sub("_", file.name or "")[-100:].lstrip(".") or "votes")
        with path.open("wb") as kept:
            for piece in file.chunks():
                kept.write(piece)
        return import_votes(
            path=path,
            name=form.cleaned_data["name"],
            is_simulated=form.cleaned_data["is_simulated"],
            actor=actor,
        )


def _too_large() -> str:
    return (
        f"The file has more than {MOST_MB} MB. "
        "Send a smaller one, or use “manage.py import_votes”."
    )
