"""Two experts vote at once; every vote is kept once and the export agrees with a count."""

from __future__ import annotations

import csv
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.browser.chromium import chromium
from tests.stack import Home

pytestmark = [
    pytest.mark.browser,
    pytest.mark.redis,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.xdist_group("demo"),
]
STUDY = "Two at once"
VOTES = 12
PASSWORD = "a password to vote with"


def sign_in(page: Page, address: str, username: str) -> None:
    page.goto(f"{address}/login/")
    page.fill("input[name=username]", username)
    page.fill("input[name=password]", PASSWORD)
    page.click("form[action*=login] button, main form button")
    page.wait_for_url(f"{address}/")


def vote_all(address: str, username: str, *, by_key: bool) -> list[str]:
    """Vote on every pair, by keys or by clicks; returns the answers in order."""
    answers = []
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        sign_in(page, address, username)
        page.click("a[href*='/vote/']")
        for number in range(VOTES):
            # Both pictures are decoded when the form takes answers.
            page.wait_for_selector("form#vote:not([inert])")
            answer = ("left", "equal", "right")[(number + len(username)) % 3]
            here = page.input_value("input[name=matchup]")
            if by_key:
                page.keyboard.press(str(("left", "equal", "right").index(answer) + 1))
            else:
                page.click(f"button[name=outcome][value={answer}]")
            page.locator(f"input[name=matchup][value='{here}']").wait_for(state="detached")
            answers.append(answer)
        assert "You are done" in page.inner_text("main")
    return answers


@pytest.fixture(scope="module")
def home(demo_home: Home, tmp_path_factory: pytest.TempPathFactory) -> Home:
    home = demo_home.copy(tmp_path_factory.mktemp("two") / "h")
    for username in ("ada", "grace"):
        printed = home.must("add_person", username, "--role", "expert")
        assert "Password (shown once)" in printed
        set_password(home, username)
    home.must(
        *("open_study", STUDY, "--contestants", "reference", "rule-placer", "sim-careless-otm"),
        *("--scenarios", *augmented(home), "--experts", "ada", "grace"),
        *("--votes-per-expert", str(VOTES), "--seed", "3", "--allow-simulated"),
    )
    return home


def augmented(home: Home) -> list[str]:
    """The scenarios that the demo's job was about."""
    return [
        slug
        for (slug,) in home.rows(
            "SELECT slug FROM augment_scenario WHERE id IN"
            " (SELECT scenario_id FROM augment_augmentation)"
        )
    ]


def set_password(home: Home, username: str) -> None:
    code = (
        "from django.contrib.auth.models import User;"
        f"u = User.objects.get(username={username!r}); u.set_password({PASSWORD!r}); u.save()"
    )
    home.must("shell", "-c", code)


def test_two_browsers_vote_at_once_and_the_export_agrees(home: Home, tmp_path: Path) -> None:
    with home.serving() as address, ThreadPoolExecutor(2) as pool:
        by_keys = pool.submit(vote_all, address, "ada", by_key=True)
        by_clicks = pool.submit(vote_all, address, "grace", by_key=False)
        cast = by_keys.result() + by_clicks.result()
    rows = votes(home)
    assert len(rows) == 2 * VOTES
    assert len({row["matchup"] for row in rows}) == 2 * VOTES
    assert Counter(row["outcome"] for row in rows) == Counter(cast)

    home.must("close_study", STUDY)
    home.must("rate", STUDY)
    file = tmp_path / "table.csv"
    home.must("export", "leaderboard", STUDY, "--format", "csv", "--out", str(file))
    with file.open(newline="") as table:
        exported = {row["slug"]: row for row in csv.DictReader(table)}
    for slug, counted in count_by_hand(rows).items():
        assert {key: int(exported[slug][key]) for key in counted} == counted


def votes(home: Home) -> list[dict[str, str]]:
    """Every vote of the study, straight from the database."""
    found = home.rows(
        "SELECT v.matchup_id, v.outcome, l.slug, r.slug"
        " FROM arena_vote v JOIN arena_matchup m ON m.id = v.matchup_id"
        " JOIN arena_study s ON s.id = m.study_id"
        " JOIN augment_augmentation al ON al.id = m.left_id"
        " JOIN augment_contestant l ON l.id = al.contestant_id"
        " JOIN augment_augmentation ar ON ar.id = m.right_id"
        " JOIN augment_contestant r ON r.id = ar.contestant_id"
        f" WHERE s.name = '{STUDY}'"
    )
    return [dict(zip(("matchup", "outcome", "left", "right"), row, strict=True)) for row in found]


def count_by_hand(rows: list[dict[str, str]]) -> dict[str, dict[str, int]]:
    counts: dict[str, dict[str, int]] = {}
    for row in rows:
        for side, other in (("left", "right"), ("right", "left")):
            mine = counts.setdefault(row[side], {"votes": 0, "wins": 0, "ties": 0, "losses": 0})
            mine["votes"] += 1
            kind = {"equal": "ties", side: "wins", other: "losses"}[row["outcome"]]
            mine[kind] += 1
    return counts
