"""An expert who follows every link and tries every address learns nothing of the contestants.

Channel by channel: addresses, pages, replies, headers, the chunks and sizes of pictures, tokens,
sides and order, results, and what other roles know.
"""

import re

import numpy as np
import pytest
from django.contrib.auth.models import Group, User
from django.test import Client
from scipy import stats

from arena.jobs.services import open_labelling
from arena.models import LabellingRound, Matchup, Study
from augment.models import Augmentation, Contestant, Endpoint, GenerationJob
from augment.services.scenarios.pictures import store
from tests.entering import CARD
from tests.journeys.blindness import (
    Answer,
    answer_of,
    crawl,
    every_view,
    fill,
    leaks,
    vote_through,
    word_leaks,
)
from tests.study_rows import a_study, hang
from tests.web.cast import png

pytestmark = pytest.mark.django_db

SECRETS = ("zanzibar", "xylophone", "quixotic")
SMALL = png(200, width=3, height=2)
TOKENS = [field.name for field in Matchup._meta.fields if field.name.endswith("_token")]


@pytest.fixture
def study() -> Study:
    """An open study whose contestants have telling names, models, variants and agents."""
    study = a_study(contestants=SECRETS)
    endpoint = Endpoint.objects.create(label="hosted-llama", base_url="https://llama.example/v1")
    Contestant.objects.filter(slug="zanzibar").update(
        name="Zanzibar OTM",
        kind=Contestant.Kind.LLM,
        variant="otm",
        model="llama-3.1-70b",
        endpoint=endpoint,
    )
    Contestant.objects.filter(slug="quixotic").update(kind=Contestant.Kind.SUBMISSION, card=CARD)
    for number, row in enumerate(Augmentation.objects.order_by("pk")):
        hang(row, store(png(number, width=1200, height=300)))
    job = GenerationJob.objects.filter(augmentations__contestant__slug="zanzibar").first()
    assert job is not None
    open_labelling(name="Faults", job=job, experts=["eva"], seed=1)
    return study


@pytest.fixture
def eva(client: Client, study: Study) -> Client:
    client.force_login(User.objects.get(username="eva"))
    return client


def matchups_page(study: Study) -> str:
    return f"/api/v1/matchups?study={study.code}&n=4"


OF_PROGRAMS = ("/healthz", "/readyz")
"""What anybody may ask: a word for each part of the installation, and nothing of a study."""


def every_address(study: Study) -> list[str]:
    """Every address of the product, filled with codes and tokens that exist."""
    row = Augmentation.objects.first()
    assert row is not None
    matchup = study.matchups.first()
    assert matchup is not None
    codes = {
        *(study.code, row.job.code, row.code, row.scenario.code, row.contestant.code),
        LabellingRound.objects.get().code,
    }
    token = matchup.left_token
    return sorted(
        {fill(address, str(code), token) for _, address in every_view() for code in codes}
    )


# --- What comes back ---------------------------------------------------------------------------


def test_following_every_link_tells_nothing(eva: Client, study: Study) -> None:
    seen = crawl(eva, ["/", matchups_page(study)])
    for part, what in (("/i/", "picture"), ("/vote/", "voting page"), ("/label/", "labelling")):
        assert any(part in address for address in seen), f"the crawl saw no {what}"
    assert leaks(study, seen) == []
    for page in ("/", f"/studies/{study.code}/vote/"):
        assert not re.search(rb"(?i)\b(model|LLM|generated|ground truth)\b", seen[page].body), page


@pytest.mark.slow
def test_trying_every_address_tells_nothing(eva: Client, study: Study) -> None:
    known = [address for address in every_address(study) if address not in OF_PROGRAMS]
    addresses = [address for address in known if not address.startswith("/i/")]
    assert leaks(study, crawl(eva, addresses), guessed=True) == []


@pytest.mark.slow
def test_voting_to_the_end_tells_nothing(eva: Client, study: Study) -> None:
    seen = vote_through(eva, study)
    assert sum(address.startswith("/api/v1/votes#") for address in seen) == 9
    seen |= crawl(eva, ["/", f"/studies/{study.code}/vote/"])
    assert leaks(study, seen) == []


def test_the_page_after_a_label_tells_nothing_either(eva: Client, study: Study) -> None:
    labelling = LabellingRound.objects.get()
    page = f"/label/{labelling.code}/"
    eva.post(page, {"task": labelling.tasks.all()[0].code, "position": "on"})
    seen = crawl(eva, [page])
    assert b"The automatic checks" in seen[page].body
    assert leaks(study, seen) == []


# --- Pictures and their tokens -----------------------------------------------------------------


def test_every_showing_has_tokens_of_its_own(study: Study) -> None:
    rows = list(Matchup.objects.filter(study=study))
    tokens = [getattr(row, name) for row in rows for name in TOKENS]
    assert len(tokens) == len(set(tokens)) == len(rows) * len(TOKENS)
    pictures = {row.left.image for row in rows} | {row.right.image for row in rows}
    assert len(tokens) > len(pictures), "no picture was shown twice: nothing was proved"
    assert all(len(token) >= 32 for token in tokens)


# --- Sides and order ---------------------------------------------------------------------------


def side_p_value(rows: list[Matchup]) -> float:
    """How likely contestants are on the left so unevenly often by chance (chi-square)."""
    names = sorted({row.left.contestant_id for row in rows})
    left = np.array([sum(row.left.contestant_id == name for row in rows) for name in names])
    right = np.array([sum(row.right.contestant_id == name for row in rows) for name in names])
    expected = (left + right) / 2
    statistic = float(((left - expected) ** 2 / (expected / 2)).sum())
    return float(stats.chi2.sf(statistic, df=len(names) - 1))


def order_p_value(rows: list[Matchup]) -> float:
    """How likely the places of a contestant's showings are so uneven (Kruskal-Wallis)."""
    names = sorted({row.left.contestant_id for row in rows})
    places = [
        [r.position for r in rows if name in (r.left.contestant_id, r.right.contestant_id)]
        for name in names
    ]
    return float(stats.kruskal(*places).pvalue)


def test_neither_side_nor_order_tells_contestants_apart() -> None:
    study = a_study(
        contestants=("ann", "bob", "cid", "dora"),
        scenarios=10,
        experts=("eva", "finn", "greta"),
        votes_per_expert=40,
    )
    rows = list(study.matchups.select_related("left", "right"))
    assert side_p_value(rows) > 0.01
    assert order_p_value(rows) > 0.01
    for row in rows:  # planted: the same pairs, the sides by name, the first contestant first
        if row.left.contestant_id > row.right.contestant_id:
            row.left, row.right = row.right, row.left
    assert side_p_value(rows) < 1e-6
    rows.sort(key=lambda row: row.left.contestant_id)
    for position, row in enumerate(rows):
        row.position = position
    assert order_p_value(rows) < 1e-6


# --- Results and roles -------------------------------------------------------------------------


def test_who_is_made_a_researcher_in_the_middle_is_told_nothing_before_a_look(
    eva: Client, study: Study
) -> None:
    User.objects.get(username="eva").groups.add(Group.objects.get_or_create(name="researcher")[0])
    assert eva.get(f"/studies/{study.code}/vote/").status_code == 403
    gate = eva.get(f"/studies/{study.code}/results/")
    assert b"Opening results ends your voting in this study." in gate.content
    # The glossary of staff explains OTM on every page, whatever the study compares.
    gate.content = re.sub(
        rb'<details class="menu glossary".*?</details>', b"", gate.content, flags=re.S
    )
    assert word_leaks(study, {"gate": answer_of(gate)}) == []


# --- The suite itself: a planted leak turns it red ----------------------------------------------

PICTURE = {"Content-Type": "image/png", "Cache-Control": "private"}
JSON = {"Content-Type": "application/json"}
TEXT_CHUNK = b"\0\0\0\x0atEXtSomething\0\0\0\0"


PLANTED: list[tuple[str, dict[str, str], bytes, str]] = [
    ("/", {}, b"<h1>Zanzibar against the rest</h1>", "tells 'zanzibar'"),
    ("/media/zanzibar.png", {}, b"", "tells 'zanzibar'"),
    ("/i/1", PICTURE | {"ETag": '"3f2c"'}, SMALL, "has a header ETag"),
    ("/i/1", PICTURE | {"Last-Modified": "Fri"}, SMALL, "has a header Last-Modified"),
    ("/i/1", PICTURE | {"Cache-Control": "public"}, SMALL, "by others than the browser"),
    ("/i/1", PICTURE | {"Content-Disposition": 'inline; filename="3f.png"'}, SMALL, "a file"),
    ("/i/1", PICTURE, SMALL[:33] + TEXT_CHUNK + SMALL[33:], "has a chunk tEXt"),
    ("/i/1", PICTURE, SMALL + b"made by hand", "goes on after its end"),
    ("/api/v1/matchups", JSON, b'[{"matchup": "m", "batch": 3}]', "has a field 'batch'"),
]


def test_a_planted_leak_is_found(study: Study) -> None:
    for address, headers, body, found in PLANTED:
        seen = {address: Answer(status=200, headers=headers, body=body)}
        assert any(found in leak for leak in leaks(study, seen)), found


def test_a_picture_of_another_size_is_found(eva: Client, study: Study) -> None:
    first = study.matchups.get(expert__username="eva", position=1)
    hang(first.left, store(png(200, width=600, height=400)))
    assert any(
        "sizes that differ" in leak for leak in leaks(study, crawl(eva, [matchups_page(study)]))
    )
