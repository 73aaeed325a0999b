"""Rows of arena: people, tokens, invitations, studies, authors, votes, ratings, boards, labels."""

from arena.models.boards import Board, BoardTable
from arena.models.files import BenchmarkFile, ScenarioFile, StudyFile
from arena.models.people import ApiToken, Person, Receipt, fresh_token
from arena.models.ratings import (
    EarlyLook,
    ImportedVote,
    SharedRating,
    Snapshot,
    Standing,
    VoteFile,
)
from arena.models.studies import Matchup, Study
from arena.models.taking_part import (
    Authorship,
    EnrolledVoter,
    Enrolment,
    Invitation,
    PracticePair,
    StudyDraft,
    token_digest,
)
from arena.models.votes import (
    AIDS,
    OUTCOME_LETTERS,
    FaultLabel,
    LabellingRound,
    LabelTask,
    Question,
    Report,
    Vote,
)
