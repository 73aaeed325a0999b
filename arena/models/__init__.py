"""Rows of arena: people, tokens, invitations, studies, authors, votes, ratings, fault labels."""

from __future__ import annotations

from arena.models.api_tokens import ApiToken
from arena.models.authorships import Authorship
from arena.models.drafts import StudyDraft
from arena.models.enrolments import EnrolledVoter, Enrolment
from arena.models.invitations import Invitation, token_digest
from arena.models.labels import FaultLabel, LabellingRound, LabelTask
from arena.models.people import Person
from arena.models.practice import PracticePair
from arena.models.ratings import EarlyLook, ImportedVote, Snapshot, Standing, VoteFile
from arena.models.scenario_files import ScenarioFile
from arena.models.studies import Matchup, Study
from arena.models.study_files import StudyFile
from arena.models.tokens import fresh_token
from arena.models.votes import AIDS, OUTCOME_LETTERS, Report, Vote

__all__ = [
    "AIDS",
    "OUTCOME_LETTERS",
    "ApiToken",
    "Authorship",
    "EarlyLook",
    "EnrolledVoter",
    "Enrolment",
    "FaultLabel",
    "ImportedVote",
    "Invitation",
    "LabelTask",
    "LabellingRound",
    "Matchup",
    "Person",
    "PracticePair",
    "Report",
    "ScenarioFile",
    "Snapshot",
    "Standing",
    "Study",
    "StudyDraft",
    "StudyFile",
    "Vote",
    "VoteFile",
    "fresh_token",
    "token_digest",
]
