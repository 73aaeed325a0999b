"""An installation of an earlier version goes on with this one: nothing that people made is lost.

fixtures/upgrade/39907c1.tar.xz is the database and the pictures of that commit's small demo, with
two votes in its open study.
"""

import csv
import io
import tarfile
from pathlib import Path

import pytest

from tests.processes import ROOT
from tests.stack import Home

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]

MADE_BY_PEOPLE = {
    "arena_vote": "key, outcome, matchup_id, expert_id, winner_id, at, comment, reason",
    "arena_matchup": "code, study_id, expert_id, left_image, right_image, left_token, position",
    "arena_study": "code, name, state, seed, rules, preregistration",
    "augment_augmentation": "code, state, modification, reason, options",
}
LEADERBOARD = [
    ("1", "Reference", "1133.66", "1047.59", "1219.73", "107"),
    ("1", "Simulated good OTM (simulated)", "1100.86", "1010.99", "1190.73", "76"),
    ("1", "Rule placer", "1026.72", "940.55", "1112.89", "77"),
    ("4", "Simulated careless OTM (simulated)", "738.76", "640.30", "837.22", "140"),
]
"""As the earlier version exported it."""
VOTE_AGAIN = r"""
import json
import re
import uuid
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from arena.models import Study
expert = Client(HTTP_HOST="localhost")
expert.force_login(User.objects.get(username="expert"))
page = reverse("vote", args=[Study.objects.get(state="open").code])
shown = expert.get(page).content.decode()
pictures = re.findall(r'src="(/i/[^"]+)"', shown)
assert len(pictures) >= 2, shown
for picture in pictures:
    assert b"".join(expert.get(picture)).startswith(b"\x89PNG")
given = json.loads(re.search(r'<script id="given" [^>]*>(.*?)</script>', shown)[1])
ballot = {"key": str(uuid.uuid4()), "matchup": given["pairs"][0]["matchup"], "outcome": "A"}
answer = expert.post(given["urls"]["votes"], ballot, content_type="application/json")
assert answer.status_code == 200, answer.content
"""
NAME_IS_EXPLAINED = """
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from augment.models import Contestant
row = Contestant.objects.get(slug="sim-careless-fc")
staff = Client(HTTP_HOST="localhost")
staff.force_login(User.objects.filter(is_superuser=True).first())
page = staff.get(reverse("contestant", args=[row.code])).content.decode()
assert "Simulated careless FC runs FC-plus: it was named before FC meant" in page, page
"""


@pytest.fixture
def upgraded(tmp_path: Path) -> tuple[Home, dict[str, list[tuple[object, ...]]]]:
    """The installation after `prepare`, and its rows as they were before."""
    with tarfile.open(ROOT / "fixtures" / "upgrade" / "39907c1.tar.xz") as stored:
        stored.extractall(tmp_path, filter="data")
    home = Home.at(tmp_path)
    before = {table: home.rows(query_of(table)) for table in MADE_BY_PEOPLE}
    home.must("prepare")
    return home, before


def query_of(table: str) -> str:
    return f"SELECT {MADE_BY_PEOPLE[table]} FROM {table} ORDER BY 1"


def test_no_vote_picture_or_study_of_an_earlier_version_is_lost(
    upgraded: tuple[Home, dict[str, list[tuple[object, ...]]]],
) -> None:
    home, before = upgraded
    assert len(before["arena_vote"]) == 202
    for table, rows in before.items():
        assert home.rows(query_of(table)) == rows, table
    with tarfile.open(ROOT / "fixtures" / "upgrade" / "39907c1.tar.xz") as stored:
        pictures = [member for member in stored.getmembers() if member.name.endswith(".png")]
        for member in pictures:
            content = stored.extractfile(member)
            assert content is not None
            assert (home.folder / member.name).read_bytes() == content.read()
    assert len(pictures) == 60
    exported = home.must(
        *("export", "leaderboard", "Demo (simulated votes)", "--format", "csv", "--out", "-")
    )
    lines = csv.DictReader(io.StringIO(exported))
    columns = ("rank", "model", "elo", "lower", "upper", "votes")
    assert [tuple(line[column] for column in columns) for line in lines] == LEADERBOARD
    home.must("shell", "--verbosity", "0", "-c", VOTE_AGAIN)
    # What was fc had our function: slugs and names stay, and what was frozen names no other.
    assert home.rows(
        "SELECT slug, name, variant FROM augment_contestant WHERE variant LIKE 'fc%'"
    ) == [("sim-careless-fc", "Simulated careless FC", "fc-plus")]
    home.must("shell", "--verbosity", "0", "-c", NAME_IS_EXPLAINED)
    votes = home.rows(
        "SELECT v.outcome FROM arena_vote v JOIN arena_matchup m ON v.matchup_id = m.id "
        "JOIN arena_study s ON m.study_id = s.id WHERE s.state = 'open' ORDER BY m.position"
    )
    assert [outcome for (outcome,) in votes] == ["left", "equal", "left"]
