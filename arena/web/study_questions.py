"""What an admin is asked before a study opens, closes, or pairs go to somebody else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from django.db import transaction
from django.urls import reverse
from django.utils.translation import gettext as _

from arena.models import Study, StudyDraft
from arena.queries.votes import tallies
from arena.services.handing_over import hand_over
from arena.services.previews import preview_study
from arena.web.questions import Confirmation


def opening(rules: dict[str, Any], draft: StudyDraft | None = None) -> Confirmation:
    """What the study would be.

    Args:
        rules: As `open_study` takes them.
        draft: What they were set up in, if anything.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    found = preview_study(rules)
    numbers = asdict(found)
    facts = [
        _(
            "Experts: %(experts)s. Votes: %(votes)s. Contestants: %(contestants)s. Scenarios: "
            "%(scenarios)s."
        )
        % numbers,
        _("On top of the votes: hidden repeats %(repeats)s, attention checks %(checks)s.")
        % numbers,
        _("Pairs of a scenario that are judged: %(judged)s; by two experts or more: %(shared)s.")
        % numbers,
        _("Minutes for each expert: about %(minutes)s, at %(seconds)s s a pair.")
        % (numbers | {"seconds": f"{found.seconds:g}"}),
    ]
    facts += _settled_facts(found.settled, found.alike)
    if found.later:
        facts.append(
            _("Votes that are planned later, by those before: %(n)s.") % {"n": found.later}
        )
    if rules["allow_simulated"]:
        facts.append(_("What is simulated may take part; every page and file then says so."))
    facts.append(_("Experts can vote at once. The rules can’t be changed afterwards."))
    page = (_("New study"), reverse("study-new"))
    if draft is not None:
        page = (_("Draft"), reverse("study-draft", args=[draft.code]))
    return Confirmation(
        title=_("Open the study “%(name)s”?") % {"name": rules["name"]},
        facts=tuple(facts),
        button=_("Open the study"),
        back=page[1],
        is_final=False,
        crumbs=((_("Studies"), reverse("studies")), page),
    )


def cancelling(study: Study) -> Confirmation:
    """What ends, what stays, and how it differs from closing; its name has to be typed."""
    lines = tallies(study)
    facts = [
        _("No more votes are taken, and the study is never rated: it has no results.")
        + " "
        + _("This can’t be taken back."),
        _("Votes that stay and can be exported as votes: %(given)s.")
        % {"given": sum(line.voted for line in lines)},
        _("Experts read that it was cancelled and that nothing is left to do."),
        _("To end it with results, close it instead. Its settings can be used again for another."),
    ]
    if study.snapshots.exists():
        facts.insert(1, _("Ratings that were made early are shown to nobody any more."))
    return Confirmation(
        title=_("Cancel the study “%(name)s”?") % {"name": study.name},
        facts=tuple(facts),
        button=_("Cancel the study"),
        back=reverse("study", args=[study.code]),
        phrase=study.name,
        asks_why=True,
        crumbs=_crumbs(study),
    )


def discarding(draft: StudyDraft) -> Confirmation:
    """Nothing but the draft goes."""
    name = draft.name or _("Study without a name")
    return Confirmation(
        title=_("Discard the draft “%(name)s”?") % {"name": name},
        facts=(_("What was entered is gone then. No expert has seen anything of it."),),
        button=_("Discard the draft"),
        back=reverse("study-draft", args=[draft.code]),
        crumbs=(
            (_("Studies"), reverse("studies")),
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
        _("Votes given: %(given)s. Pairs skipped: %(skipped)s.")
        % {"given": given, "skipped": skipped},
        _("Planned votes that will be missing: %(n)s. Experts who are not done: %(experts)s.")
        % {"n": missing, "experts": unfinished},
        _("No more votes are taken. This can’t be taken back."),
        _("Its results can be read then, also by its experts. To end it without any, cancel it."),
    )
    return Confirmation(
        title=_("Close the study “%(name)s”?") % {"name": study.name},
        facts=facts,
        button=_("Close the study"),
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
        *(
            _("Pairs that %(name)s takes: %(n)s.") % {"name": name, "n": number}
            for name, number in taken.items()
        ),
        _("%(name)s no longer sees them; votes that were given stay.") % {"name": giver},
        _("The pairs are planned anew for who takes them. This can’t be taken back."),
    )
    return Confirmation(
        title=_("Hand over what %(name)s has not judged?") % {"name": giver},
        facts=facts,
        button=_("Hand over"),
        back=reverse("study", args=[study.code]),
        crumbs=_crumbs(study),
    )


def _crumbs(study: Study) -> tuple[tuple[str, str], ...]:
    address = reverse("study", args=[study.code])
    return ((_("Studies"), reverse("studies")), (study.name, address))


def _settled_facts(settled: int, alike: int) -> list[str]:
    if not settled:
        return []
    return [
        _(
            "Pairs that are settled as ties and shown to nobody: %(settled)s; within 0.15 m "
            "and 2° in every object: %(alike)s, identical pictures among them."
        )
        % {"settled": settled, "alike": alike}
        + " A tenth of those that are alike and not identical is shown all the same."
    ]
