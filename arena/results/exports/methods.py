"""The methods of a study for a paper: a paragraph, and a sheet in the form of HEDS.

HEDS is Shimorina and Belz's Human Evaluation Datasheet (2022); numbers are those of its questions.
Answers come from the preregistration and the rating. What neither says is blank, never guessed.
"""

import json
from collections import Counter
from dataclasses import dataclass
from typing import Any

from arena.exports.formats import formats, json_bytes
from arena.exports.latex import escape
from arena.models import Question, Snapshot
from arena.rating.comparisons import Estimate
from arena.results.exports.tables import method_text
from arena.studies.services.opening import preregistration_sha256
from augment.errors import Conflict

BLANK = "[BLANK]"
"""What authors have to fill in."""

_QUESTIONS = {
    "1.1": "Link to the paper",
    "1.2": "Link to resources",
    "1.3": "Name, affiliation, address",
    "2.1": "Input of the systems",
    "2.2": "Output of the systems",
    "2.3": "Task",
    "2.4": "Input language",
    "2.5": "Output language",
    "3.1.1": "Outputs evaluated per system",
    "3.1.2": "Selection of outputs",
    "3.1.3": "Statistical power",
    "3.2.1": "Number of evaluators",
    "3.2.2": "Kind of evaluators (experts, paid, known to the authors, authors)",
    "3.2.3": "Recruitment",
    "3.2.4": "Training and practice",
    "3.2.5": "Other characteristics",
    "3.3.1": "Preregistration",
    "3.3.2": "Collection of responses",
    "3.3.3": "Quality assurance",
    "3.3.4": "Interface",
    "3.3.5": "Freedom of time",
    "3.3.6": "Questions and feedback",
    "3.3.7": "Experimental conditions",
    "3.3.8": "Variation of conditions",
    "4.1.1": "Type of quality",
    "4.1.2": "Aspect of outputs",
    "4.1.3": "Frame of reference",
    "4.2.1": "Objective or subjective",
    "4.2.2": "Absolute or relative",
    "4.2.3": "Intrinsic or extrinsic",
    "4.3.1": "Name of the criterion",
    "4.3.2": "Definition",
    "4.3.3": "Size of the scale",
    "4.3.4": "Values of the scale",
    "4.3.5": "Presentation of the scale",
    "4.3.6": "Task without a scale",
    "4.3.7": "Verbatim question",
    "4.3.8": "Form of elicitation",
    "4.3.9": "Aggregation",
    "4.3.10": "Effect size and significance",
    "4.3.11": "Agreement between and within evaluators",
    "5.1": "Ethics committee",
    "5.2": "Personal data",
    "5.3": "Special categories of data",
    "5.4": "Impact assessments",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyMethods:
    """Methods of a rated study.

    Attributes:
        answers: By the number of the question; what is absent is blank.
        versions: Of what the numbers depend on.
        paragraph: Sentences as plain text.
    """

    study: str
    rating: str
    answers: dict[str, str]
    versions: dict[str, str]
    paragraph: tuple[str, ...]
    simulated: bool


def study_methods(snapshot: Snapshot) -> StudyMethods:
    """Return the methods of a rating.

    Raises:
        Conflict: Its study has no preregistration, as those of votes from elsewhere.
    """
    study = snapshot.study
    if not study.preregistration:
        raise Conflict(f"'{study.name}' has no preregistration, so nobody knows how it was held.")
    facts = _Facts(snapshot)
    answers = _answer_design(facts) | _answer_criterion(facts)
    paragraph = (
        f"{facts.voters} compared {facts.contestants} contestants on {facts.scenarios} scenarios, "
        f"two at a time and without knowing whose they were.",
        f"They were asked: {facts.question}",
        answers["3.1.2"],
        f"{snapshot.votes_cast} votes count; left out: {facts.left_out}.",
        answers["3.3.3"],
        answers["4.3.11"],
        answers["4.3.9"],
        answers["4.3.10"],
        f"Recruitment: {BLANK}. Compensation: {BLANK}. Ethics approval: {BLANK}.",
    )
    return StudyMethods(
        study=study.name,
        rating=str(snapshot.code),
        answers=answers,
        versions={name: str(version) for name, version in sorted(snapshot.versions.items())},
        paragraph=paragraph,
        simulated=snapshot.includes_simulated,
    )


def methods_json(methods: StudyMethods) -> bytes:
    """Return the sheet: every question of HEDS, with null where authors have to answer."""
    return json_bytes(
        {
            "format": "scenario-arena/methods",
            "version": 1,
            "form": "Human Evaluation Datasheet (Shimorina and Belz 2022)",
            "study": methods.study,
            "rating": methods.rating,
            "simulated": methods.simulated,
            "questions": [
                {"number": number, "question": text, "answer": methods.answers.get(number)}
                for number, text in _QUESTIONS.items()
            ],
            "blank": [number for number in _QUESTIONS if number not in methods.answers],
            "versions": methods.versions,
        }
    )


def methods_latex(methods: StudyMethods) -> bytes:
    """Return a paragraph for a paper; blanks are bold."""
    bold = rf"\textbf{{{escape(BLANK)}}}"
    comments = [f"{methods.study}, rating {methods.rating}"]
    if methods.simulated:
        comments.append("SIMULATED: votes or contestants are made by the machine.")
    comments.append(", ".join(f"{name} {version}" for name, version in methods.versions.items()))
    lines = [f"% {escape(comment)}" for comment in comments]
    lines += [escape(sentence).replace(escape(BLANK), bold) for sentence in methods.paragraph]
    return ("\n".join(lines) + "\n").encode()


METHODS_FORMATS = formats(latex=methods_latex, json=methods_json)


# --- Private -----------------------------------------------------------------------------------


class _Facts:
    """Numbers and words that several answers share."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.snapshot, self.frozen = snapshot, json.loads(snapshot.study.preregistration)
        self.rules: dict[str, Any] = self.frozen["rules"]
        board = snapshot.results.board
        self.contestants = len(self.frozen["contestants"])
        self.scenarios = len(self.frozen["scenarios"])
        simulated = " (simulated in part or whole)" if snapshot.includes_simulated else ""
        counts = set(Counter(entry["contestant"] for entry in self.frozen["pictures"]).values())
        self.outputs = " to ".join(map(str, sorted({min(counts), max(counts)})))
        self.voters = f"{board.experts} evaluators{simulated}"
        self.question = str(Question(snapshot.question or snapshot.study.questions[0]).label)
        left_out = snapshot.votes_left_out.items()
        self.left_out = ", ".join(f"{number} {why}" for why, number in sorted(left_out)) or "none"


def _answer_design(facts: _Facts) -> dict[str, str]:
    study, frozen, rules = facts.snapshot.study, facts.frozen, facts.rules
    shares = {
        "hidden repeats": rules.get("repeat_share", 0.0),
        "attention checks": rules.get("check_share", 0.0),
    }
    used = [f"{100.0 * share:.0f} % {name}" for name, share in shares.items() if share]
    voting = f"{len(study.rules['experts'])} accounts with {study.votes_per_expert} pairs each"
    return {
        "2.1": "Recorded traffic scenes (structured data) and one instruction each (text).",
        "2.2": "What is added, moved or removed (structured data), shown as a picture.",
        "2.3": "Other: editing a traffic scene as an instruction says.",
        "2.4": ", ".join(sorted({row.language for row in study.scenarios.all()})),
        "2.5": "N/A",
        "3.1.1": facts.outputs,
        "3.1.2": (
            f"A balanced plan ({frozen['product']['planner']}, seed {frozen['seed']}) chose pairs "
            f"and sides before the first vote, for {voting}; "
            f"{len(rules.get('identical', ()))} pairs that nobody can tell apart count as ties."
        ),
        "3.2.1": str(facts.snapshot.results.board.experts),
        "3.2.4": "Five practice pairs with answers." if study.practice else "No practice pairs.",
        "3.3.1": f"Frozen before the first vote; SHA-256 {preregistration_sha256(study)}.",
        "3.3.2": f"Scenario Arena {frozen['product']['version']}, on its pages.",
        "3.3.3": (
            f"{' and '.join(used) or 'No hidden repeats or attention checks'}, never rated; "
            "no vote is removed by them."
        ),
        "3.3.4": "The instruction, two pictures of one scene side by side, and the answers.",
        "3.3.5": "Neither a time limit nor one sitting: work is kept after each pair.",
    }


def _answer_criterion(facts: _Facts) -> dict[str, str]:
    snapshot = facts.snapshot
    study, trust = snapshot.study, snapshot.results.trust
    values = ["A is better", "equal", "B is better"]
    if study.allow_both_miss:
        values.append("equal, and both miss the instruction")
    agreed = []
    if trust.agreement is not None:
        alpha, units = _text(trust.agreement.alpha), trust.agreement.units
        agreed.append(f"Krippendorff's alpha (nominal) is {alpha} on {units} shared pairs.")
    if trust.repeats is not None:
        same = _text(trust.repeats.same)
        agreed.append(
            f"Of {trust.repeats.number} hidden repeats a share of {same} was answered alike."
        )
    apart = snapshot.results.board.above
    told = "not judged" if apart is None else f"{len(apart)} pairs are told apart"
    return {
        "4.2.1": "Subjective",
        "4.2.2": "Relative",
        "4.3.1": str(snapshot.question or study.questions[0]),
        "4.3.3": str(len(values)),
        "4.3.4": "; ".join(values),
        "4.3.5": "Buttons and keys.",
        "4.3.6": "N/A",
        "4.3.7": facts.question,
        "4.3.8": "Relative quality estimation",
        "4.3.9": f"{method_text(snapshot)}; the mean is 1000.",
        "4.3.10": (
            "Differences of ratings in points, all pairs judged at once at 5 % for the whole "
            f"table: {told}."
        ),
        "4.3.11": " ".join(agreed) or "Not measured: no pair was judged twice.",
    }


def _text(estimate: Estimate) -> str:
    """Return a value with its interval, as far as the votes determine them."""
    if estimate.value is None:
        return "undetermined"
    if estimate.lower is None or estimate.upper is None:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} (95 % {estimate.lower:.2f} to {estimate.upper:.2f})"
