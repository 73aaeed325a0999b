"""Pages of boards: their dated tables, publishing one, opening a batch, the public link."""

import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth.decorators import login_not_required
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.exports.files import CONTENT_TYPE, zip_bytes
from arena.exports.formats import attach
from arena.models import Board, BoardTable, Study
from arena.people.queries import by_pseudonym, experts
from arena.rating.board_table import PROVISIONAL_ABOVE
from arena.results.exports.board_files import board_folder, write_table
from arena.results.pages.plots import plot
from arena.results.services.batches import BatchRequest, open_batch, possible_newcomers
from arena.results.services.boards import LONGEST_NAME, make_board, publish_table, share_board
from arena.shell.access import ADMIN, STAFF, act_for, form_for, get_user, keep_secret, page_for
from arena.shell.acts import refusals_in, tell_errors
from arena.shell.forms import RequestForm, offer
from arena.voting.queries.blinding import refuse_open_judge
from augment.models import Benchmark
from augment.services import read_request, to_inputs
from augment.services.benchmarks import list_remarks

DATA = {"csv": "text/csv; charset=utf-8", "json": "application/json"}
LOOK = forms.CheckboxSelectMultiple


class BoardForm(forms.Form):
    """A new board."""

    name = forms.CharField(
        max_length=LONGEST_NAME,
        help_text="Experts see it in the names of batches: it should name no contestant.",
    )
    study = forms.ModelChoiceField(
        Study.objects.filter(state=Study.State.CLOSED, vote_file=None),
        label="First study",
        to_field_name="code",
        empty_label=None,
        help_text="Its scenarios and rules are those of the board.",
    )
    benchmark = forms.ModelChoiceField(
        Benchmark.objects.filter(retired_at=None),
        to_field_name="code",
        required=False,
        empty_label="None",
        help_text="Where the study shows just its test split; its version stands in every table.",
    )
    provisional_above = forms.IntegerField(
        label="Provisional above ± points",
        min_value=1,
        max_value=1000,
        initial=PROVISIONAL_ABOVE,
        help_text="A contestant with a wider interval is marked as provisional in every table.",
    )


class BatchForm(RequestForm):
    """A new batch; experts and votes are at first those of the newest study."""

    inputs = to_inputs(BatchRequest)

    def __init__(self, data: Any = None, *, board: Board) -> None:
        newest = board.studies.order_by("-opened_at", "-pk")[0]
        super().__init__(
            data,
            initial={
                "experts": list(newest.experts.values_list("username", flat=True)),
                "votes_per_expert": newest.votes_per_expert,
            },
        )
        people = [(user.username, user.person.pseudonym) for user in by_pseudonym(experts())]
        newcomers = possible_newcomers(board).values_list("slug", "name")
        for name, choices in (("newcomers", newcomers), ("experts", people)):
            self.fields[name].widget = LOOK()
            offer(self, name, choices)


@form_for(*STAFF)
def boards_page(request: HttpRequest) -> HttpResponse:
    """All boards, and a form for a new one."""
    form = BoardForm(request.POST or None)
    if form.is_valid():
        with refusals_in(form):
            board = make_board(**form.cleaned_data, actor=get_user(request))
            return redirect("board", code=board.code)
    boards = Board.objects.prefetch_related("tables", "studies")
    return render(request, "boards/list.html", {"boards": boards, "form": form})


@page_for(*STAFF)
def board_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The newest table or that which the address names; the studies, and what can be done."""
    board = get_object_or_404(Board, code=code)
    context = _context(request, board) | {"form": BatchForm(board=board)}
    context["studies"] = studies = board.studies.order_by("opened_at", "pk")
    published = context["tables"][0].document.studies if context["tables"] else ()
    closed = {str(row.code) for row in studies if row.state == Study.State.CLOSED}
    context["has_news"] = bool(closed - {table.code for table in published})
    if board.token:
        address = reverse("shared-board", args=[board.token])
        context["shared_address"] = request.build_absolute_uri(address)
    return render(request, "boards/board.html", context)


@page_for(*STAFF)
def board_file(request: HttpRequest, code: uuid.UUID, number: int, form: str) -> HttpResponse:
    """A table as it was published."""
    return _file(get_object_or_404(Board, code=code), number, form)


@page_for(*STAFF)
def board_export(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """All tables as a folder for any web host."""
    board = get_object_or_404(Board, code=code)
    name = f"{slugify(board.name) or 'board'}.zip"
    return attach(zip_bytes(board_folder(board)), CONTENT_TYPE, name)


# --- Acts --------------------------------------------------------------------------------------


@act_for(*STAFF, back="board")
def publish(request: HttpRequest, code: uuid.UUID) -> None:
    """Rate all votes and publish the next table."""
    board = get_object_or_404(Board, code=code)
    table = publish_table(board, write=write_table, actor=get_user(request))
    messages.success(request, f"Table {table.number} is published.")


@act_for(ADMIN, back="board")
def start_batch(request: HttpRequest, code: uuid.UUID) -> HttpResponse | None:
    """Open a study of the chosen newcomers against those who are rated."""
    board = get_object_or_404(Board, code=code)
    form = BatchForm(request.POST, board=board)
    if not form.is_valid():
        tell_errors(request, form)
        return None
    request_of_batch = read_request(BatchRequest, form.cleaned_data)
    study = open_batch(board, request_of_batch, actor=get_user(request))
    return redirect("study", code=study.code)


@act_for(*STAFF, back="board")
def share(request: HttpRequest, code: uuid.UUID, *, is_shared: bool) -> None:
    """Make the link by which anybody reads the tables, or take it back."""
    board = get_object_or_404(Board, code=code)
    share_board(board, is_shared=is_shared, actor=get_user(request))


# --- For whoever has the link ------------------------------------------------------------------


@login_not_required
@require_safe
def show_board(request: HttpRequest, token: str) -> HttpResponse:
    """The same tables without the studies behind them."""
    board = _find_board(request, token)
    return keep_secret(render(request, "boards/shared.html", _context(request, board)))


@login_not_required
@require_safe
def send_table(request: HttpRequest, token: str, number: int, form: str) -> HttpResponse:
    """A table as it was published."""
    return keep_secret(_file(_find_board(request, token), number, form))


# --- Private -----------------------------------------------------------------------------------


def _find_board(request: HttpRequest, token: str) -> Board:
    board = get_object_or_404(Board, token=token)
    refuse_open_judge(request.user, board.studies.all())
    return board


def _context(request: HttpRequest, board: Board) -> dict[str, Any]:
    """The table that the address names, the newest unless it does."""
    tables = list(board.tables.defer("files"))
    number = request.GET.get("table")
    shown = [table for table in tables if number in (None, str(table.number))]
    if tables and not shown:
        raise Http404
    remarks = list_remarks(board.benchmark)
    context: dict[str, Any] = {"board": board, "tables": tables, "remarks": remarks}
    if not shown:
        return context
    table = shown[0].document
    drawn = plot(table.lines)
    rows = [(line["row"], line["mark"]) for line in drawn["lines"]]
    return context | {"table": table, "rows": rows, "ticks": drawn["ticks"]}


def _file(board: Board, number: int, form: str) -> HttpResponse:
    table = get_object_or_404(BoardTable, board=board, number=number)
    if form not in DATA:
        raise Http404
    name = f"{slugify(board.name) or 'board'}-{number}.{form}"
    return attach(table.files[form].encode(), DATA[form], name)
