"""Every number of the results, computed again from the raw votes of one small study.

What computes it here is another's package (statsmodels, scipy) or plain loops, never
our own ratings. Numbers that are drawn at random are held against what they estimate, within the
error of the draws.
"""

import math
from collections import Counter

import numpy as np
import pytest
from scipy.stats import t

from tests.results.oracles import codes, elo_of, glm, influences, moderated, squares
from tests.results.raw import Shown

pytestmark = pytest.mark.django_db  # so that there is a database; the study is made once


def test_ratings_intervals_and_ranks(shown: Shown) -> None:
    rating = elo_of(glm(shown.main, shown.slugs), shown.slugs)
    half, _ = moderated(shown.main, shown.slugs)
    lower = {slug: rating[slug] - one for slug, one in zip(shown.slugs, half, strict=True)}
    upper = {slug: rating[slug] + one for slug, one in zip(shown.slugs, half, strict=True)}
    for slug, line in shown.lines.items():
        assert line.rating == pytest.approx(rating[slug], abs=1e-4)
        assert (line.lower, line.upper) == pytest.approx((lower[slug], upper[slug]), rel=1e-5)
        assert line.rank == 1 + sum(lower[other] > upper[slug] for other in shown.slugs)


def test_counts_of_every_line_and_what_the_page_prints(shown: Shown) -> None:
    standings = [row for row in shown.rows if len(row) == 5]
    details = [row for row in shown.rows if len(row) == 7]
    for slug, line in shown.lines.items():
        own = [vote.score_of(slug) for vote in shown.main if slug in vote.names]
        counts = [own.count(points) for points in (1.0, 0.5, 0.0)]
        assert [line.wins, line.ties, line.losses] == counts
        standing = next(row for row in standings if row[1] == line.name)
        (detail,) = (row for row in details if row[0] == line.name)
        half = (line.upper - line.lower) / 2
        rating, votes = f"{line.rating:.0f}", str(len(own))
        assert standing == [str(line.rank), line.name, rating, "", votes]
        assert detail[1] == f"±{half:.0f}"
        score = f"{round(100 * np.mean(own))} %"
        assert detail[3:] == [score, *map(str, counts)]


def test_ties_and_what_is_left_out(shown: Shown) -> None:
    ties = np.mean([vote.score == 0.5 for vote in shown.main])
    assert shown.results.trust.tie_share == pytest.approx(ties)
    assert f"{100 * ties:.0f} % of the votes are ties" in shown.said
    assert f"Counted {len(shown.main)} votes" in shown.said
    kinds = Counter(vote.kind for vote in shown.votes)
    assert f"{kinds['check']} attention checks" in shown.said
    assert f"{kinds['repeat']} hidden repeats" in shown.said


def test_what_an_expert_less_changes(shown: Shown) -> None:
    votes, slugs = shown.main, shown.slugs
    whole = elo_of(glm(votes, slugs), slugs)

    def places(rating: dict[str, float]) -> dict[str, int]:
        order = sorted(slugs, key=lambda slug: -rating[slug])
        return {slug: order.index(slug) for slug in slugs}

    for line in shown.results.trust.raters:
        rest = elo_of(glm([v for v in votes if v.judge != line.name], slugs), slugs)
        now, then = places(whole), places(rest)
        assert line.moves == max(abs(now[slug] - then[slug]) for slug in slugs)
        decided = [v for v in votes if v.judge == line.name and v.score != 0.5]
        hits = [(v.score == 1.0) == (rest[v.left] > rest[v.right]) for v in decided]
        assert line.favourites.value == pytest.approx(np.mean(hits))
        assert line.decided == len(hits)
    moves = [line.moves for line in shown.results.trust.raters if line.moves is not None]
    said = f"moves a contestant by at most {max(moves)} place"
    assert (said in shown.said) == (max(moves) > 0)


# --- Pairs and types -------------------------------------------------------------------


def test_pairs_their_scores_and_adjusted_p_values(shown: Shown) -> None:
    slugs = shown.slugs
    pulls, _ = influences(shown.main, slugs)
    experts = codes([vote.judge for vote in shown.main])
    cells = experts * 1000 + codes([vote.item for vote in shown.main])
    covariance = squares(pulls, cells)
    rating = elo_of(glm(shown.main, slugs), slugs)
    adjusted = {frozenset((one.a, one.b)): one.p for one in shown.results.board.p_values or ()}
    for pair in shown.results.pairs:
        both = frozenset((pair.a, pair.b))
        own = [vote.score_of(pair.a) for vote in shown.main if vote.names == both]
        counts = [own.count(points) for points in (1.0, 0.5, 0.0)]
        assert [pair.wins, pair.ties, pair.losses] == counts
        assert pair.planned == shown.planned[both]
        # Never surer than a single test of independent votes with as many degrees as experts.
        a, b = slugs.index(pair.a), slugs.index(pair.b)
        variance = covariance[a, a] + covariance[b, b] - 2 * covariance[a, b]
        size = abs(rating[pair.a] - rating[pair.b]) / math.sqrt(0.5 * variance)
        assert adjusted[both] >= 2 * t.sf(size, 1000) - 1e-9
    assert len(np.unique(experts)) >= 5
    above = shown.results.board.above
    assert {frozenset(pair) for pair in above} == {
        pair for pair, p in adjusted.items() if p <= 0.05
    }
    for line in shown.lines.values():
        over = sum(pair[1] == line.slug for pair in above)
        under = sum(pair[0] == line.slug for pair in above)
        assert (line.rank_best, line.rank_worst) == (1 + over, len(slugs) - under)


def test_each_type_is_rated_by_its_own_votes(shown: Shown) -> None:
    assert sum(not part.reasons for part in shown.results.types) >= 3
    for part in shown.results.types:
        votes = [vote for vote in shown.main if vote.type == part.type]
        assert (part.votes, part.scenarios) == (len(votes), len({vote.item for vote in votes}))
        if part.reasons:  # somebody won or lost all: then statsmodels has no answer, either
            continue
        rating = elo_of(glm(votes, shown.slugs), shown.slugs)
        half, _ = moderated(votes, shown.slugs)
        for line in part.lines:
            assert line.votes == sum(line.slug in vote.names for vote in votes)
            assert line.rating == pytest.approx(rating[line.slug], abs=1e-3)
            width = half[shown.slugs.index(line.slug)]
            for bound, sign in ((line.lower, -1), (line.upper, 1)):
                if bound is not None:
                    assert bound == pytest.approx(rating[line.slug] + sign * width, rel=1e-4)
