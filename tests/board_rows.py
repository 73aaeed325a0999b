"""A board that grows: a first study and batches, voted by dice."""

from datetime import UTC, datetime
from random import Random

from arena.models import Board, BoardTable, Matchup, Study
from arena.results.exports.board_files import write_table
from arena.results.services.batches import BatchRequest, open_batch
from arena.results.services.boards import make_board, publish_table
from augment.models import Contestant, Scenario
from tests.study_rows import a_study, contestant, picture, vote_all

STRENGTH = {"ann": 3, "bob": 2, "cid": 1, "dot": 4, "eli": 2}


def day(number: int) -> datetime:
    return datetime(2026, 1, number, 12, tzinfo=UTC)


def voted(study: Study, seed: int = 1) -> Study:
    """The study with a vote on every matchup, closed."""
    dice = Random(seed)

    def outcome(pair: Matchup) -> str:
        left, right = (
            STRENGTH[side.contestant.slug] * dice.random() for side in (pair.left, pair.right)
        )
        return "equal" if abs(left - right) < 0.3 else "left" if left > right else "right"

    return vote_all(study, outcome)


def a_board() -> Board:
    """Of three contestants, six scenarios and two experts, without a table."""
    return make_board(name="City", study=voted(a_study(votes_per_expert=18)))


def newcomer(slug: str, kind: str = Contestant.Kind.RULE) -> Contestant:
    """A contestant with a picture of every scenario."""
    row = contestant(slug, kind)
    for place in Scenario.objects.all():
        picture(place, row)
    return row


def a_batch(board: Board, *newcomers: str, votes: int = 18) -> Study:
    asked = BatchRequest(newcomers=newcomers, experts=("eva", "finn"), votes_per_expert=votes)
    return open_batch(board, asked)


def published(board: Board, number: int) -> BoardTable:
    return publish_table(board, write=write_table, now=day(number))
