"""What an admin is asked before a study opens, closes, or pairs go to somebody else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from django.db import transaction
from django.urls import reverse

from arena.models import Study, StudyDraft
from arena.queries.voting.ballots import tallies
from arena.services.handing_over import hand_over
from arena.services.previews import preview_study
from arena.services.study_plan import StudyPlan
from arena.site.acts import Confirmation


def opening(study_plan: StudyPlan, draft: StudyDraft | None = None) -> Confirmation:
    """What the study would be.

    Args:
        study_plan: As it was entered.
        draft: What it was set up in, if anything.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    found = preview_study(study_plan)
    numbers = asdict(found)
    facts = [
        (
            "Experts: {experts}. Votes: {votes}. Contestants: {contestants}. Scenarios: "
            "{scenarios}."
        ).format(**numbers),
        "On top of the votes: hidden repeats {repeats}, attention checks {checks}.".format(
            **numbers
        ),
        "Pairs of a scenario that are judged: {judged}; by two experts or more: {shared}.".format(
            **numbers
        ),
        "Minutes for each expert: about %(minutes)s, at %(seconds)s s a pair."
        % (numbers | {"seconds": f"{found.seconds:g}"}),
    ]
    facts += _settled_facts(found.settled, found.alike)
    if found.later:
        facts.append(f"Votes that are planned later, by those before: {found.later}.")
    if study_plan.allow_simulated:
        facts.append("What is simulated may take part; every page and file then says so.")
    facts.append("Experts can vote at once. The rules can’t be changed afterwards.")
    page = ("New study", reverse("study-new"))
    if draft is not None:
        page = ("Draft", reverse("study-draft", args=[draft.code]))
    return Confirmation(
        title=f"Open the study “{study_plan.name}”?",
        facts=tuple(facts),
        button="Open the study",
        back=page[1],
        is_final=False,
        crumbs=(("Studies", reverse("studies")), page),
    )


def cancelling(study: Study) -> Confirmation:
    """What ends, what stays, and how it differs from closing; its name has to be typed."""
    lines = tallies(study)
    facts = [
        "No more votes are taken, and the study is never rated: it has no results. "
        "This can’t be taken back.",
        f"Votes that stay and can be exported as votes: {sum(line.voted for line in lines)}.",
        "Experts read that it was cancelled and that nothing is left to do.",
        "To end it with results, close it instead. Its settings can be used again for another.",
    ]
    if study.snapshots.exists():
        facts.insert(1, "Ratings that were made early are shown to nobody any more.")
    return Confirmation(
        title=f"Cancel the study “{study.name}”?",
        facts=tuple(facts),
        button="Cancel the study",
        back=reverse("study", args=[study.code]),
        phrase=study.name,
        asks_why=True,
        crumbs=_crumbs(study),
    )


def discarding(draft: StudyDraft) -> Confirmation:
    """Nothing but the draft goes."""
    name = draft.name or "Study without a name"
    return Confirmation(
        title=f"Discard the draft “{name}”?",
        facts=("What was entered is gone then. No expert has seen anything of it.",),
        button="Discard the draft",
        back=reverse("study-draft", args=[draft.code]),
        crumbs=(
            ("Studies", reverse("studies")),
            (name, reverse("study-draft", args=[draft.code])),
        ),
    )


def closing(study: Study) -> Confirmation:
    """What is there, and what will never come."""
    lines = tallies(study)
    given = sum(line.voted for line in lines)
    skipped = sum(line.skips for line in lines)
    missing = sum(line.left for line in lines)
    unfinished = sum(line.left > 0 for line in lines)
    facts = (
        f"Votes given: {given}. Pairs skipped: {skipped}.",
        f"Planned votes that will be missing: {missing}. Experts who are not done: {unfinished}.",
        "No more votes are taken. This can’t be taken back.",
        "Its results can be read then, also by its experts. To end it without any, cancel it.",
    )
    return Confirmation(
        title=f"Close the study “{study.name}”?",
        facts=facts,
        button="Close the study",
        back=reverse("study", args=[study.code]),
        crumbs=_crumbs(study),
    )


def handing_over(study: Study, giver: str, takers: Sequence[str]) -> Confirmation:
    """Counted by handing over and taking that back at once.

    Raises:
        ArenaError, AugmentError: It can't be done.
    """
    with transaction.atomic():
        taken = hand_over(study=study, username=giver, to=takers)
        transaction.set_rollback(True)
    facts = (
        *(f"Pairs that {name} takes: {number}." for name, number in taken.items()),
        f"{giver} no longer sees them; votes that were given stay.",
        "The pairs are planned anew for who takes them. This can’t be taken back.",
    )
    return Confirmation(
        title=f"Hand over what {giver} has not judged?",
        facts=facts,
        button="Hand over",
        back=reverse("study", args=[study.code]),
        crumbs=_crumbs(study),
    )


def _crumbs(study: Study) -> tuple[tuple[str, str], ...]:
    address = reverse("study", args=[study.code])
    return (("Studies", reverse("studies")), (study.name, address))


def _settled_facts(settled: int, alike: int) -> list[str]:
    if not settled:
        return []
    return [
        (
            f"Pairs that are settled as ties and shown to nobody: {settled}; within 0.15 m "
            f"and 2° in every object: {alike}, identical pictures among them."
        )
        + " A tenth of those that are alike and not identical is shown all the same."
    ]
