"""Geometric review, our own: the deterministic checks speak, no model does.

What they measure and find wrong or doubtful goes back to the modifier as facts. Where the scenario
has an intent they are held against it as well: such a review knows what is asked for, as no model
does. Without one a doubtful finding may be just what was asked for: a modifier that keeps its
modification in spite of doubts has the last word, in spite of what is wrong it has not.
"""

from __future__ import annotations

from augment.checks import Finding, Severity
from augment.checks.registry import check_against_intent
from augment.prompts.names import short_names
from augment.variants.review import Review, Submission, Verdict

_TOLD = (Severity.WRONG, Severity.DOUBTFUL)


def review_geometry(submission: Submission) -> Verdict:
    """What the checks make of a modification."""
    findings = check_against_intent(submission.ground, submission.modification, submission.intent)
    shown = [one for severity in _TOLD for one in findings if one.severity is severity]
    wrong = sum(one.severity is Severity.WRONG for one in shown)
    doubtful = len(shown) - wrong
    insists = doubtful > 0 and submission.modification == submission.earlier
    accepted = wrong == 0 and (doubtful == 0 or insists)
    names = short_names(submission.scene)
    known = names.agents | names.lanes
    return Verdict(
        is_accepted=accepted,
        score=(-float(wrong), -float(doubtful)),
        feedback=tuple(
            f"{one.severity.value.capitalize()}: {one.sentence(known)}" for one in shown
        ),
        is_measured=True,
        summary=f"{wrong} findings wrong, {doubtful} doubtful",
        document={
            "wrong": wrong,
            "doubtful": doubtful,
            "accepted": accepted,
            "findings": [_document(one, known) for one in findings],
        },
    )


def _document(finding: Finding, names: dict[str, str]) -> dict[str, object]:
    return {
        "kind": finding.kind.value,
        "severity": finding.severity.value,
        "agents": list(finding.agents),
        "sentence": finding.sentence(names),
    }


GEOMETRIC_REVIEW = Review(name="geometric", judge=review_geometry)
