"""Agreement of metrics and judge models with the votes of a study."""

from collections.abc import Iterable
from dataclasses import replace

from arena.jobs.queries import list_shown_ids
from arena.models import Snapshot, Study
from arena.rating import agreement
from arena.results.queries.judges import judge_preferences
from arena.results.queries.votes import COUNTED, Filters, RatedVote, current_votes
from arena.results.services.analysis import SCORES
from arena.voting.queries.blinding import is_imported
from augment.services.judging import metric_scores


def rater_agreement(snapshot: Snapshot) -> tuple[agreement.AgreementLine, ...]:
    """Measure how metrics and judge models agree with the votes of a rating, by question.

    Args:
        snapshot: Says which votes count. Augmentations are scored as they are now; those of votes
            from a file are not known.
    """
    study, filters = snapshot.study, Filters.of_document(snapshot.filters)
    if is_imported(study):
        return ()
    metrics, lines = study_raters(study), []
    for question in study.questions:
        asked_for = replace(filters, question=question)
        votes = pair_votes(current_votes(study, asked_for, snapshot.last_vote))
        raters = [*metrics, *judge_raters(study, question)]
        lines += [
            replace(line, question=question) for line in agreement.measure_agreement(votes, raters)
        ]
    return tuple(lines)


def pair_votes(votes: Iterable[RatedVote]) -> list[agreement.PairVote]:
    """Return the votes that count."""
    return [
        agreement.PairVote(
            judge=vote.judge,
            item=vote.item,
            type=vote.type,
            left=vote.left_code,
            right=vote.right_code,
            preference=int(2.0 * SCORES[vote.outcome] - 1.0),
        )
        for vote in votes
        if vote.mark == COUNTED
    ]


def study_raters(study: Study) -> list[agreement.NamedRater]:
    """Return the metrics by which one augmentation of a study is better than another."""
    return [
        agreement.rater_by_scores(scores.name, scores.by_code, tolerance=scores.tolerance)
        for scores in metric_scores(list_shown_ids(study))
    ]


def judge_raters(study: Study, question: str) -> list[agreement.NamedRater]:
    """Return the models that compared the pairs of a study by a question."""
    judges = judge_preferences(study, question)
    return [agreement.rater_by_pairs(name, preferences) for name, preferences in judges.items()]
