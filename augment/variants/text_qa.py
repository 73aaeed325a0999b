"""The text QA agent: summarises, asks itself, answers, and rates in three categories.

It gets the scene, the wish and the changed vectors, never the modifier's reasoning. The mean of
its ratings is computed here.
"""

from __future__ import annotations

from functools import partial

from augment.errors import ModelRefused, ReplyUnreadable, ReviewUnusable
from augment.prompts import fill
from augment.prompts.reply import RatedReview, read_ratings
from augment.variants.respondents import Inquiry
from augment.variants.review import Review, Submission, Verdict
from augment.variants.transcript import ModelRole


def review_text(submission: Submission) -> Verdict:
    """The text reviewer's verdict.

    Raises:
        ReviewUnusable: He declined, or neither his first nor his re-asked ratings can be read.
        ModelFault: The wire broke for good.
    """
    limits = submission.limits
    messages = fill.reviewer_messages(
        submission.scene,
        submission.instruction,
        submission.modification,
        radius_m=limits.radius_m,
        earlier=submission.told,
    )
    inquiry = Inquiry(
        respondents=submission.respondents,
        role=ModelRole.REVIEWER,
        again=fill.review_re_ask_messages,
        max_tokens=limits.max_tokens,
        re_asks=limits.re_asks,
    )
    try:
        review, _, _ = inquiry.read(
            messages, partial(read_ratings, accepted_from=limits.accepted_from)
        )
    except ReplyUnreadable as unreadable:
        raise ReviewUnusable(f"the reviewer: {'; '.join(unreadable.problems)}") from unreadable
    except ModelRefused as refused:
        raise ReviewUnusable(f"the reviewer declined: {refused}") from refused
    return _verdict(review, limits.accepted_from)


def _verdict(review: RatedReview, accepted_from: float) -> Verdict:
    ratings = review.ratings
    accepted = ratings.mean >= accepted_from
    return Verdict(
        is_accepted=accepted,
        score=(ratings.mean,),
        feedback=() if accepted else tuple(entry.sentence for entry in review.feedback),
        summary=(
            f"mean rating {ratings.mean:.2f} (compliance {ratings.compliance}, realism "
            f"{ratings.realism}, logical consistency {ratings.logical_consistency})"
        ),
        document={
            "ratings": ratings.model_dump(),
            "mean": round(ratings.mean, 4),
            "feedback": [entry.model_dump() for entry in review.feedback],
            "remarks": list(review.remarks),
            "summary": review.summary,
            "questions": review.questions,
            "answers": review.answers,
        },
    )


TEXT_REVIEW = Review(
    name="text", judge=review_text, asks=(ModelRole.REVIEWER,), options=("accepted_from",)
)
