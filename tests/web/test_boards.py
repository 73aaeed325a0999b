"""Boards by pages alone: from a closed study to tables that anybody reads."""

import io
import json
import zipfile
from datetime import date
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command
from django.test import Client
from django.urls import reverse

from arena.models import Board, Study
from augment.models import Benchmark, Contestant, Submission
from tests.board_rows import newcomer, voted
from tests.study_rows import a_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.mark.slow
def test_a_board_grows_by_pages_alone_and_anybody_reads_it_by_its_link(tmp_path: Path) -> None:
    first = voted(a_study(votes_per_expert=18))
    dot = newcomer("dot", Contestant.Kind.SUBMISSION)
    Contestant.objects.filter(pk=dot.pk).update(card={"authors": ["Ada", "Bo"], "is_open": False})
    cast = people()
    benchmark = Benchmark.objects.create(slug="x", title="X", version=1, made_on=date(2026, 1, 1))
    for decision, sender in (("accepted", 0), ("withdrawn", 0), ("none", 0), ("withdrawn", 1)):
        Submission.objects.create(
            benchmark=benchmark,
            decision=decision,
            contestant=dot if decision == "accepted" else None,
            report={},
            size_bytes=1,
            uploaded_by=[cast["researcher"], cast["admin"]][sender],
        )
    admin, stranger = signed_in(cast["admin"]), Client()
    made = {"name": "City", "study": str(first.code), "provisional_above": "100"}
    admin.post(reverse("boards"), made)
    board = Board.objects.get()
    page = reverse("board", args=[board.code])
    assert "No table was published yet." in admin.get(page).content.decode()
    publish = reverse("board-publish", args=[board.code])
    admin.post(publish)
    shown = admin.get(page).content.decode()
    assert "with 36 votes" in shown
    assert "Dot" in shown
    assert "Publish a new table" not in shown
    asked = {"newcomers": ["dot"], "experts": ["eva", "finn"], "votes_per_expert": 18}
    answer = admin.post(reverse("board-batch", args=[board.code]), asked)
    batch = Study.objects.get(name="City, batch 1")
    assert answer.headers["Location"] == reverse("study", args=[batch.code])
    shown = admin.get(reverse("study", args=[batch.code])).content.decode()
    assert f'dot (a batch of <a href="{page}">City</a>)' in shown
    assert "is still open" in admin.post(publish, follow=True).content.decode()
    voted(batch, seed=2)
    assert "Table 2 is published." in admin.post(publish, follow=True).content.decode()
    old = admin.get(page, {"table": "1"}).content.decode()
    assert "The newest table" in old
    assert admin.get(page, {"table": "3"}).status_code == 404

    admin.post(reverse("board-share", args=[board.code]))
    board.refresh_from_db()
    address = reverse("shared-board", args=[board.token])
    assert address in admin.get(page).content.decode()
    public = stranger.get(address)
    assert "noindex" in public.headers["X-Robots-Tag"]
    assert "72 votes" in public.content.decode()
    assert "eva" not in public.content.decode()
    data = stranger.get(f"{address}2.json").content
    cards = {one["slug"]: (one["authors"], one["is_open"]) for one in json.loads(data)["lines"]}
    assert cards.keys() == {"ann", "bob", "cid", "dot"}
    assert (cards["ann"], cards["dot"]) == (([], None), (["Ada", "Bo"], False))
    assert "Ada, Bo (closed)" in public.content.decode()
    tries = {
        one["slug"]: (one["submitted"], one["withdrawn"]) for one in json.loads(data)["lines"]
    }
    assert (tries["ann"], tries["dot"]) == ((None, None), (3, 1))
    assert "submitted 3, withdrawn 1" in public.content.decode()
    assert public.content.decode().count(">provisional<") == 1
    assert "within ±100 points" in public.content.decode()
    assert stranger.get(f"{address}1.csv").content.startswith(b"rank,contestant,elo")
    assert stranger.get(f"{address}1.html").status_code == 404

    packed = admin.get(reverse("board-export", args=[board.code])).content
    call_command("export", "board", "City", out=str(tmp_path / "site"))
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    assert inside == {path.name: path.read_bytes() for path in (tmp_path / "site").iterdir()}
    assert inside["table-2.json"] == data
    with pytest.raises(CommandError, match="City"):
        call_command("export", "board", "Village", out=str(tmp_path / "site"))

    admin.post(reverse("board-unshare", args=[board.code]))
    assert stranger.get(address).status_code == 404
