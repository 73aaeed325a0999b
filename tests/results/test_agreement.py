"""Which metric agrees with the experts of the demo's study, whose simulated votes are known."""

import json
from collections.abc import Iterator

import pytest
from django.urls import reverse

from arena.models import Snapshot, Study, Vote
from arena.rating.agreement import AgreementLine, LineRole
from arena.results.exports.writers import RATING_FILES
from arena.results.services.ratings import rate_now
from arena.site import demo
from arena.site.demo import RATED, SIMULATED_EXPERTS, hold_study
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant
from tests.golden.test_demo_study import OFF_M, PLACES, document
from tests.study_rows import a_study, contestant, expert, picture, scenario, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def rating() -> Snapshot:
    kinds = {RATED[0]: Contestant.Kind.REFERENCE}
    makers = {slug: contestant(slug, kinds.get(slug, Contestant.Kind.RULE)) for slug in RATED}
    for number in range(PLACES):
        place = scenario(f"place-{number:02d}")
        place.reference = document(20.0 + number)
        place.save()
        for slug, maker in makers.items():
            off_m = OFF_M[slug] * (0.5 + number / PLACES)
            row = picture(place, maker)
            Augmentation.objects.filter(pk=row.pk).update(
                modification=document(20.0 + number + off_m)
            )
    for username in SIMULATED_EXPERTS:
        expert(username, is_simulated=True)
    study = hold_study(scenarios=[f"place-{number:02d}" for number in range(PLACES)])
    return study.snapshots.get()


def lines_of(rating: Snapshot) -> dict[str, AgreementLine]:
    return {line.rater: line for line in rating.results.agreement}


def decided(rating: Snapshot) -> Iterator[tuple[Augmentation, Augmentation]]:
    """Who won and who lost, straight from the rows."""
    rows = Vote.objects.filter(matchup__study=rating.study).exclude(winner=None)
    for row in rows.select_related("shown_left__contestant", "shown_right__contestant"):
        sides = [row.shown_left, row.shown_right]
        yield tuple(sorted(sides, key=lambda side: side.pk != row.winner_id))  # type: ignore[misc]


@pytest.mark.slow
def test_a_simulated_study_that_was_cut_short_is_gone_on_with(
    rating: Snapshot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kill(**_: object) -> None:
        raise KeyboardInterrupt

    places = [f"place-{number:02d}" for number in range(PLACES)]
    with monkeypatch.context() as killed:
        killed.setattr(demo, "rate_now", kill)
        with pytest.raises(KeyboardInterrupt):
            hold_study(scenarios=places, name="Cut short")
    study = hold_study(name="Cut short")
    assert (study.state, study.snapshots.count()) == (Study.State.CLOSED, 1)
    assert hold_study() == rating.study


@pytest.mark.slow
def test_displacement_and_experts_are_as_counted_from_rows_and_in_files(rating: Snapshot) -> None:
    lines, votes = lines_of(rating), list(decided(rating))
    slugs = [(won.contestant.slug, lost.contestant.slug) for won, lost in votes]
    known = [pair for pair in slugs if RATED[0] not in pair]
    hits = sum(OFF_M[won] < OFF_M[lost] for won, lost in known)
    found = lines["Displacement"]
    assert (found.agrees, found.differs, found.unknown) == (
        *(hits, len(known) - hits),
        len(votes) - len(known),
    )
    assert found.share.value == pytest.approx(hits / len(known))
    assert lines["Experts with each other"].role == LineRole.EXPERTS
    assert lines["A coin"].known == len(votes)
    check_page_and_files(rating)


def check_page_and_files(rating: Snapshot) -> None:
    found = lines_of(rating)["Displacement"]
    client = signed_in(people()["researcher"])
    address = reverse("results-tab", args=[rating.study.code, "agreement"])
    shown = " ".join(client.get(address).content.decode().split())
    assert "Closest to the experts: Displacement, in agreement on" in shown
    assert f"of {found.known} decided votes; experts agree with each other on" in shown
    made = {}
    for form in RATING_FILES["agreement"].formats:
        answer = client.get(reverse("results-export", args=[rating.study.code, "agreement", form]))
        made[form] = answer.content
    first = json.loads(made["json"])["raters"][0]
    assert (first["question"], first["role"]) == ("instruction", "experts")
    assert made["csv"].decode().startswith("question,rater,role,type,share,lower,upper,decided,")
    latex = made["latex"].decode()
    coin = lines_of(rating)["A coin"]
    assert f"({coin.decided} votes, 5 experts, {coin.scenarios} scenarios)" in latex
    assert "Experts with each other: " in latex
    assert r"floor: a coin, 50 \%. (simulated)" in latex


def test_each_question_has_its_own_agreement() -> None:
    """The car nearer to the reference carries out the instruction, the other is realistic."""
    study = a_study(votes_per_expert=9, questions=("instruction", "realism"))
    off_m = {"ann": 0.0, "bob": 1.0, "cid": 2.0}
    study.scenarios.update(reference=document(20.0))
    for slug, metres in off_m.items():
        rows = Augmentation.objects.filter(contestant__slug=slug)
        rows.update(modification=document(20.0 + metres))
    for matchup in study.matchups.select_related("left__contestant", "right__contestant"):
        sides = {side: off_m[getattr(matchup, side).contestant.slug] for side in ("left", "right")}
        vote(matchup, min(sides, key=lambda side: sides[side]), question="instruction")
        vote(matchup, max(sides, key=lambda side: sides[side]), question="realism")
    rating = rate_now(study=close_study(study=study), rounds=50)
    found = {
        line.question: line.share.value
        for line in rating.results.agreement
        if line.rater == "Displacement"
    }
    assert found == {"instruction": 1.0, "realism": 0.0}
    address = reverse("results-tab", args=[study.code, "agreement"])
    shown = signed_in(people()["researcher"]).get(address).content.decode()
    assert "<h2>Which image is more realistic?</h2>" in shown
