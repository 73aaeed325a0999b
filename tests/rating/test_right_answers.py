import json
from pathlib import Path

import choix
import numpy as np
import pytest

from arena.rating import models
from arena.rating.comparisons import Comparisons, FloatArray
from arena.rating.leaderboard import Method
from tests.rating.votes import by_votes, fit, named, simulated, versus

HERE = Path(__file__).parent
TABLES = sorted((HERE / "tables").glob("*.json"))


def fitted(votes: Comparisons) -> FloatArray:
    return models.to_elo(fit(votes))


@pytest.mark.parametrize("path", TABLES, ids=[path.stem for path in TABLES])
def test_bradley_terry_of_tables_computed_by_hand(path: Path) -> None:
    table = json.loads(path.read_text())
    votes = named([vote for row in table["votes"] for vote in versus(*row)])
    expected = [table["elo"][name] for name in votes.names]
    assert fitted(votes) == pytest.approx(expected, abs=1e-4), table["what"]


def test_a_published_worked_example_comes_out() -> None:
    """Four players, 22 games; the encyclopedia's table gives the strengths to three digits."""
    votes = named(
        versus("a", "b", 2, 0, 3)
        + versus("a", "d", 1, 0, 4)
        + versus("b", "c", 5, 0, 3)
        + versus("c", "d", 1, 0, 3)
    )
    strengths = np.exp((fitted(votes) - 1000.0) / models.ELO_PER_LOGIT)
    assert strengths == pytest.approx([0.640, 1.043, 0.660, 2.270], abs=5e-4)


@pytest.mark.parametrize("ties", [0.0, 0.5])
def test_bradley_terry_agrees_with_choix(ties: float) -> None:
    votes = simulated([1090, 1040, 1000, 960, 910], 600, 1, ties=ties)
    wins = []
    for first, second, score in zip(votes.first, votes.second, votes.score, strict=True):
        wins += [(first, second)] * int(2 * score) + [(second, first)] * int(2 - 2 * score)
    theirs = choix.opt_pairwise(5, wins, method="Newton-CG", tol=1e-10)
    assert fitted(votes) == pytest.approx(models.to_elo(theirs), abs=1e-3)


def test_one_elo_vote_moves_half_of_k() -> None:
    board = by_votes(named(versus("a", "b", 1, 0, 0)), method=Method.ELO, rounds=5)
    assert [line.rating for line in board.lines] == [1002.0, 998.0]
