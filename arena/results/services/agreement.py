"""Which metrics agree with the votes of a study."""

from collections.abc import Sequence

from arena.jobs.queries import shown_augmentations
from arena.models import Study
from arena.rating.agreement import (
    AgreementLine,
    NamedRater,
    PairVote,
    measure_agreement,
    rater_by_scores,
)
from arena.results.queries.votes import Judged
from arena.results.services.analysis import SCORES
from augment.services.judging.metric_scores import metric_scores


def rater_agreement(study: Study, votes: Sequence[Judged]) -> tuple[AgreementLine, ...]:
    """Measure how metrics agree with the votes that count.

    Args:
        study: Its augmentations are scored as they are now.
        votes: Those on pairs that nobody was shown say nothing.
    """
    return measure_agreement(pair_votes(votes), study_raters(study))


def pair_votes(votes: Sequence[Judged]) -> list[PairVote]:
    """Return the votes that people gave on pictures."""
    return [
        PairVote(
            judge=vote.judge,
            item=vote.item,
            type=vote.type,
            left=vote.left_code,
            right=vote.right_code,
            preference=int(2.0 * SCORES[vote.outcome] - 1.0),
        )
        for vote in votes
        if vote.left_code
    ]


def study_raters(study: Study) -> list[NamedRater]:
    """Return whatever prefers one augmentation of a study to another, beside people."""
    return [
        rater_by_scores(scores.name, scores.by_code, tolerance=scores.tolerance)
        for scores in metric_scores(shown_augmentations(study))
    ]
