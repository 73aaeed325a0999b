"""What the voting page shows and what its script is given."""

import uuid
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.urls import reverse
from django.utils.translation import gettext as _
from django.utils.translation import pgettext

from arena.models import OUTCOME_LETTERS, Report, Study, Vote
from arena.studies.queries import longest_instructions, own_enrolment
from arena.studies.services.experts import SIDES
from arena.studies.services.planning import next_pairs
from arena.voting.queries.ballots import VotingProgress, recent_votes, skip_of, voting_progress
from arena.voting.queries.keys import (
    KEY_LABELS,
    SOMETIMES,
    USUAL_KEYS,
    VotingPreferences,
    voting_preferences,
)
from arena.voting.queries.showings import as_shown

AHEAD = 5
"""The pair on the screen and four that are decoded ahead."""

UNDOABLE = 10

MODULES = tuple(
    f"js/vote-{name}.js" for name in ("outbox", "page", "pairs", "lens", "keys", "tabs")
)
"""What vote.js imports, named in the page so that all of it loads at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LastVote:
    """A vote that can still be changed.

    Attributes:
        word: What was decided, short, for a button.
        shown: The pair as the wire shows it.
    """

    key: UUID
    position: int
    outcome: str
    both_miss: bool
    comment: str
    word: str
    shown: dict[str, Any]

    @property
    def is_skip(self) -> bool:
        """For what the page says of it."""
        return self.outcome == "skip"

    @property
    def is_left(self) -> bool:
        """For the buttons of the form."""
        return self.outcome == "left"

    @property
    def is_equal(self) -> bool:
        """For the buttons of the form."""
        return self.outcome == "equal" and not self.both_miss

    @property
    def is_right(self) -> bool:
        """For the buttons of the form."""
        return self.outcome == "right"

    def as_json(self) -> dict[str, Any]:
        """For the page's script."""
        return {
            "key": str(self.key),
            "position": self.position,
            "outcome": OUTCOME_LETTERS[self.outcome],
            "both_miss": self.both_miss,
            "comment": self.comment,
            "shown": self.shown,
        }


def vote_context(study: Study, expert: User, *, change: str) -> dict[str, Any] | None:
    """The pair to judge and all around it, None when every pair is decided.

    Args:
        study: An open one.
        expert: Who votes in it.
        change: The key of one of the expert's last votes, or of any pair that is skipped still,
            to show it again; anything else shows the next pair.
    """
    matchups = next_pairs(study=study, expert=expert, n=AHEAD)
    pairs = [as_shown(matchup) for matchup in matchups]
    context = over_context(study, expert)
    last = context["last"]
    changed = next((vote for vote in last if str(vote.key) == change), None)
    if changed is None and (skip := skip_of(study=study, expert=expert, key=change)):
        changed = _as_last(skip)
    if not pairs and changed is None:
        return None
    preferences = voting_preferences(expert)
    context |= {
        "shown": changed.shown if changed else pairs[0],
        "longest": longest_instructions(study),
        "change": changed,
        "key": uuid.uuid4(),
        "alts": _alts(),
        "modules": MODULES,
        "legend": preferences.switches["legend"],
        "skip_reasons": Vote.SkipReason.choices,
        "report_reasons": Report.Reason.choices,
        "report_sides": [(name, side.label) for name, side in SIDES.items()],
        "looks": _looks(study),
        "key_labels": _key_labels(study),
        "sometimes": SOMETIMES,
    }
    context["given"] = {
        "study": str(study.code),
        "outbox": f"arena votes {expert.person.code} {study.code}",
        "urls": _urls(study),
        "alts": _alts(),
        "pairs": pairs,
        "last": [vote.as_json() for vote in last],
        "change": changed.as_json() if changed else None,
        "allow_both_miss": study.allow_both_miss,
        "preferences": _preferences(study, preferences),
        **_counts(context["progress"]),
    }
    return context


def over_context(study: Study, expert: User) -> dict[str, Any]:
    """What the pages without a pair show."""
    is_open = study.state == Study.State.OPEN
    return {
        "study": study,
        "progress": voting_progress(study=study, expert=expert),
        "last": _last_votes(study, expert) if is_open else [],
        "enrolled": own_enrolment(study, expert),
    }


# Private


def _last_votes(study: Study, expert: User) -> list[LastVote]:
    return [_as_last(vote) for vote in recent_votes(study=study, expert=expert, n=UNDOABLE)]


def _as_last(vote: Vote) -> LastVote:
    return LastVote(
        key=vote.key,
        position=vote.matchup.position,
        outcome=vote.outcome,
        both_miss=vote.both_miss,
        comment=vote.comment,
        word=_word(vote),
        shown=as_shown(vote.matchup),
    )


def _word(vote: Vote) -> str:
    if vote.both_miss:
        return pgettext("a vote", "Miss")
    words = {
        "left": pgettext("a vote", "A"),
        "equal": _("Equal"),
        "right": pgettext("a vote", "B"),
        "skip": pgettext("a vote", "Skip"),
    }
    return words[vote.outcome]


def _counts(progress: VotingProgress) -> dict[str, Any]:
    return {
        "saved": progress.voted,
        "skipped": progress.skipped,
        "total": progress.total,
        "minutes_left": progress.minutes_left,
    }


def _urls(study: Study) -> dict[str, str]:
    measures = reverse("measures", args=[study.code]).removesuffix(str(study.code))
    return {
        **({"measures": measures} if study.allow_measures else {}),
        "page": reverse("vote", args=[study.code]),
        "votes": reverse("api-votes"),
        "matchups": f"{reverse('api-matchups')}?study={study.code}",
        "reports": reverse("api-reports"),
        "preferences": reverse("api-preferences"),
    }


def _alts() -> dict[str, str]:
    return {
        "a": _("Image A, edited scene"),
        "b": _("Image B, edited scene"),
        "original": _("The scene before the edit"),
    }


def _preferences(study: Study, kept: VotingPreferences) -> dict[str, Any]:
    given = kept.as_json()
    return given | {"keys": {name: given["keys"][name] for name in _actions(study)}}


def _actions(study: Study) -> list[str]:
    """What keys do here: nothing tells of what the study does not have."""
    without = {
        "text": not study.allow_text,
        "replay": not study.allow_replay,
        "measures": not study.allow_measures,
    }
    return [name for name in USUAL_KEYS if not without.get(name)]


def _looks(study: Study) -> list[tuple[str, str]]:
    labels = {
        "original": _("Original"),
        "zoom": _("Zoom"),
        "ruler": _("Ruler"),
        "blink": _("Blink"),
        "difference": pgettext("a way to look", "Differ"),
        "measures": _("Measures"),
        "text": pgettext("a way to look", "Text"),
        "replay": _("Drives"),
        "legend": _("Legend"),
    }
    return [(name, labels[name]) for name in _actions(study) if name in labels]


def _key_labels(study: Study) -> list[tuple[str, str]]:
    return [(action, _(KEY_LABELS[action])) for action in _actions(study)]
