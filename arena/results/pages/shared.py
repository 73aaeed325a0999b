"""The table of a rating for whoever has its link: a page and its data, nothing else."""

from django.contrib.auth.decorators import login_not_required
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.formats import download
from arena.models import Snapshot, Study
from arena.results.exports.tables import for_experts, leaderboard_table
from arena.results.exports.writers import FORMATS
from arena.results.pages.tabs import describe, fill_table
from arena.shell.access import keep_secret
from arena.voting.queries.blinding import refuse_open_judge

DATA = {form: FORMATS[form] for form in ("csv", "json")}


@login_not_required
@require_safe
def show_shared(request: HttpRequest, token: str) -> HttpResponse:
    """The sentence, the table, how it came about, and links to its data."""
    snapshot = _find_snapshot(request, token)
    description = describe(snapshot, is_staff=False)
    context = {"study": snapshot.study, "snapshot": snapshot, "token": token}
    context |= description | fill_table(snapshot, description["table"])
    return keep_secret(render(request, "results/shared.html", context))


@login_not_required
@require_safe
def send_shared(request: HttpRequest, token: str, form: str) -> HttpResponse:
    """The data of the page, as CSV or JSON."""
    snapshot = _find_snapshot(request, token)
    stem = f"{slugify(snapshot.study.name) or 'study'}-leaderboard"
    table = for_experts(leaderboard_table(snapshot))
    return keep_secret(download(DATA, form, stem, table))


def _find_snapshot(request: HttpRequest, token: str) -> Snapshot:
    """The rating of a link that holds; of a study that is closed, as it was when it was shared."""
    refuse_open_judge(request.user, Study.objects.filter(snapshots__shared__token=token))
    rows = Snapshot.objects.select_related("study__vote_file")
    closed = rows.filter(study__state=Study.State.CLOSED, state=Snapshot.State.READY)
    return get_object_or_404(closed, shared__token=token)
