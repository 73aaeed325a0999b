"""Content of the voting page, and the data of its script."""

from collections.abc import Collection
from typing import Any

from django.contrib.auth.models import User
from django.db.models import Q
from django.db.models.functions import Length
from django.urls import reverse
from django.utils import timezone
from django.utils.translation import gettext as _
from django.utils.translation import pgettext

from arena.models import OUTCOME_LETTERS, Question, Report, Study, Vote
from arena.voting.queries.ballots import list_voters, own_votes, upcoming, voting_progress
from arena.voting.queries.keys import KEYS, voting_switches
from arena.voting.queries.showings import as_shown, note_objects
from arena.voting.services.reports import SIDES
from augment.services import read_code

AHEAD = 5
"""The pair on the screen and four that are decoded ahead."""

UNDOABLE = 10
"""How many pairs back; each question of one is a step."""

FIRST_PAIRS = 5
"""Over so many the legend stands as a strip, however low the window."""

LONGEST = 3
"""How many instructions: which of them takes most lines depends on words and fonts."""

MODULES = tuple(
    f"js/vote-{name}.js"
    for name in ("outbox", "pace", "page", "pairs", "lens", "keys", "tabs", "film")
)
"""What vote.js imports, named in the page so that all of it loads at once."""


def vote_context(study: Study, expert: User, *, change: str) -> dict[str, Any] | None:
    """Return the pair to judge and all around it, None when every pair is decided.

    Args:
        study: An open one.
        expert: Who votes in it.
        change: The key of one of the expert's votes to show its pair again; anything else shows
            the next pair.
    """
    pairs = [as_shown(matchup) for matchup in upcoming(study=study, expert=expert, n=AHEAD)]
    context = no_pair_context(study, expert) | _describe_questions(study)
    changed = _vote_of_key(study, expert, change)
    if not pairs and changed is None:
        return None
    switches, progress = voting_switches(expert), context["progress"]
    has = _has(study)
    keys = {name: keys for name, keys in KEYS.items() if has.get(name, True)}
    context |= _list_choices(keys)
    shown = [*pairs, changed["shown"]] if changed else pairs
    on_them = own_votes(study, expert).filter(
        matchup__code__in=[pair["matchup"] for pair in shown]
    )
    last = {vote.pk: vote for vote in (*context["last"], *on_them.reverse())}
    if study.ask_why:
        note_objects([vote.matchup for vote in last.values()])
    return context | {
        "shown": changed["shown"] if changed else pairs[0],
        "is_filmed": has["play"],
        "alts": _alts(),
        "first_pairs": FIRST_PAIRS,
        "modules": [*MODULES, *(["js/vote-why.js"] if study.ask_why else [])],
        "legend": switches["legend"],
        "pressed": [name for name, is_on in switches.items() if is_on],
        "given": {
            "study": str(study.code),
            "questions": context["questions"],
            "undoable": UNDOABLE * len(study.questions),
            "outbox": f"arena votes {expert.person.code} {study.code}",
            "urls": _urls(study),
            "alts": _alts(),
            "first_pairs": FIRST_PAIRS,
            "pairs": pairs,
            "last": [_as_json(vote) for vote in last.values()],
            "change": changed,
            "allow_both_miss": study.allow_both_miss,
            "rings": has["rings"],
            "aids": ["measures"] if study.rules.get("show_ticks") else [],
            "today": _times_today(study, expert),
            "ask_strength": study.ask_strength,
            "ask_why": study.ask_why,
            "preferences": {**switches, "keys": keys},
            "saved": progress.voted,
            "total": progress.total,
        },
    }


def no_pair_context(study: Study, expert: User) -> dict[str, Any]:
    """Return the context of the pages without a pair."""
    is_open = study.state == Study.State.OPEN
    undoable = UNDOABLE * len(study.questions)
    return {
        "study": study,
        "progress": voting_progress(study=study, expert=expert),
        "last": list(own_votes(study, expert).reverse()[:undoable]) if is_open else [],
        "enrolled": list_voters(study).filter(expert=expert).first(),
    }


def _has(study: Study) -> dict[str, bool]:
    """Return whether the study has each optional key: nothing tells of absent ones."""
    # Of a scenario in which anybody moves every picture has a film, drawn for its pairs or not.
    is_filmed = any("-film/" in entry["picture"] for entry in study.rules.get("entries", ()))
    return {
        **dict.fromkeys(("play", "back", "on", "rate"), is_filmed),
        "replay": study.allow_replay,
        "both_miss": study.allow_both_miss,
        "why": study.ask_why,
        "rings": not study.rules.get("hide_rings"),
    }


def _alts() -> dict[str, str]:
    return {
        "a": _("Image A, edited scene"),
        "b": _("Image B, edited scene"),
        "original": _("The scene before the edit"),
    }


def _urls(study: Study) -> dict[str, str]:
    return {
        "page": reverse("vote", args=[study.code]),
        "votes": reverse("api-votes"),
        "matchups": f"{reverse('api-matchups')}?study={study.code}",
        "reports": reverse("api-reports"),
        "preferences": reverse("api-preferences"),
    }


def _list_choices(keys: Collection[str]) -> dict[str, Any]:
    """Return the buttons of the tools and of the panels that they open."""
    tools = {
        "why": _("What is wrong"),
        "skip": _("Skip"),
        "report": _("Report"),
        "comment": _("Comment"),
    }
    looks = {
        "ruler": _("Ruler"),
        "blink": _("Blink"),
        "difference": pgettext("a way to look", "Differ"),
        "replay": _("Drives"),
        "rings": _("Rings"),
        "legend": _("Legend"),
    }
    return {
        "tools": [(name, label) for name, label in tools.items() if name in keys],
        "fault_classes": [
            ("position", _("Position")),
            ("heading", pgettext("of an object", "Heading")),
            ("logic", pgettext("of a scene", "Logic")),
        ],
        "skip_reasons": Vote.SkipReason.choices,
        "report_reasons": Report.Reason.choices,
        "report_sides": [(name, side.label) for name, side in SIDES.items()],
        "looks": [(name, label) for name, label in looks.items() if name in keys],
    }


def _describe_questions(study: Study) -> dict[str, Any]:
    """Return the questions about each pair, as a voter reads them."""
    questions = {key: str(Question(key).label) for key in study.questions}
    by_length = study.scenarios.order_by(Length("instruction").desc(), "pk")
    return {
        "questions": questions,
        "first_question": questions[study.questions[0]],
        "longest_question": max(questions.values(), key=len),
        "longest": list(by_length.values_list("instruction", flat=True)[:LONGEST]),
    }


def _times_today(study: Study, expert: User) -> list[int | None]:
    """Return the time on screen in ms of each pair that the expert decided today."""
    votes = own_votes(study, expert).filter(at__date=timezone.localdate())
    ends = votes.filter(Q(question=study.questions[-1]) | Q(outcome=Vote.Outcome.SKIP))
    return list(ends.values_list("ms_visible", flat=True))


def _vote_of_key(study: Study, expert: User, key: str) -> dict[str, Any] | None:
    code = read_code(key)
    if not code.int:  # voters choose their keys, so that a vote may have even this one
        return None
    vote = own_votes(study, expert).filter(key=code).first()
    if vote is None:
        return None
    if study.ask_why:
        note_objects([vote.matchup])
    return _as_json(vote)


def _as_json(vote: Vote) -> dict[str, Any]:
    vote.matchup.asked = vote.question
    return {
        "key": str(vote.key),
        "question": vote.question,
        "position": vote.matchup.position,
        "outcome": OUTCOME_LETTERS[vote.outcome],
        "both_miss": vote.both_miss,
        "strength": vote.strength,
        "comment": vote.comment,
        "aids": vote.aids.split(),
        "ms_visible": vote.ms_visible,
        "faults": _list_faults(vote),
        "shown": as_shown(vote.matchup),
    }


def _list_faults(vote: Vote) -> list[dict[str, Any]]:
    """Return marked faults in the form of the wire: by side and place."""
    left, right = vote.matchup.objects_shown or ([], [])
    places = {
        (side, mark[0]): {"side": letter, "object": place}
        for side, letter, marks in (("left", "A", left), ("right", "B", right))
        for place, mark in enumerate(marks)
    }
    return [places[side, name] | {"fault": fault} for side, name, fault in vote.faults]
