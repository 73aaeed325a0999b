"""A small study with everything that a vote can be: for what lists and counts votes."""

from arena.models import Matchup, Study
from arena.people.links import mark_author
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant, Scenario
from augment.scene.entities import ScenarioType
from tests.study_rows import a_study, contestant, matchups_of, picture, shown_again, vote

OUTCOMES = ("left", "equal", "right", "right")


def mixed_study(*, close: bool = True) -> Study:
    """Votes changed later, repeats, checks, skips, comments, aids, an author, two types.

    Twelve matchups each of eva and finn, of whom eva is author of ann; cid is simulated, and so
    are no votes. Two pairs of pictures are alike and were never shown.
    """
    study = a_study(votes_per_expert=12, contestants=("ann", "bob", "cid"))
    Scenario.objects.filter(slug__in=("place-0", "place-1")).update(type=ScenarioType.OVERTAKE)
    Contestant.objects.filter(slug="cid").update(kind=Contestant.Kind.SIMULATED)
    alike = [["place-2", "ann", "bob"], ["place-0", "ann", "cid"]]
    Study.objects.filter(pk=study.pk).update(rules=study.rules | {"identical": alike})
    for username in ("eva", "finn"):
        _vote_of(study, username)
    _checks(study)
    eva = matchups_of(study, "eva")[0].expert
    mark_author(study=study, expert=eva, contestant="ann")
    study.refresh_from_db()
    return close_study(study=study) if close else study


def _vote_of(study: Study, username: str) -> None:
    matchups = matchups_of(study, username)
    for number, matchup in enumerate(matchups):
        if number == 7:
            vote(matchup, "skip", reason="cannot_judge")
            continue
        comment = "The car stands on the kerb." if number % 5 == 0 else ""
        aids = ["zoom"] if number % 2 else []
        given = vote(
            matchup,
            OUTCOMES[number % 4],
            comment=comment,
            aids=aids,
            ms_visible=400 if number % 6 == 0 else 2500,
        )
        if number == 2:
            vote(matchup, "left", supersedes=given.key)
    skipped = shown_again(matchups[3])
    vote(skipped, "skip", reason="unclear")
    for first, outcome in ((matchups[0], "right"), (matchups[4], "left")):
        vote(shown_again(first), outcome)
    vote(shown_again(matchups[2]), "equal")


def _checks(study: Study) -> None:
    """One check of each expert; eva passes hers."""
    good = contestant("good", Contestant.Kind.REFERENCE)
    broken = contestant("broken", Contestant.Kind.CHECK)
    scenario = Scenario.objects.get(slug="place-1")
    left, right = (picture(scenario, row) for row in (good, broken))
    for username, outcome in (("eva", "left"), ("finn", "right")):
        vote(_check(study, username, left, right), outcome)


def _check(study: Study, username: str, left: Augmentation, right: Augmentation) -> Matchup:
    last = matchups_of(study, username)[-1]
    return Matchup.objects.create(
        study=study,
        expert=last.expert,
        position=last.position + 1,
        scenario=left.scenario,
        left=left,
        right=right,
        view=last.view,
        kind=Matchup.Kind.CHECK,
    )
