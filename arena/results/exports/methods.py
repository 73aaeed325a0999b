"""The methods of a study for a paper: a paragraph, and a sheet in the form of HEDS.

HEDS is Shimorina and Belz's Human Evaluation Datasheet (2022); numbers are those of its questions.
Answers come from the preregistration and the rating. What neither says is blank, never guessed.
The words are in templates/results/heds.txt and methods.tex.
"""

import json
from collections import Counter
from typing import Any

from django.conf.locale import LANG_INFO
from django.template import Context
from django.template.loader import get_template

from arena.exports.formats import formats, json_bytes
from arena.exports.latex import escape
from arena.models import Question, Snapshot
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.rating.comparisons import Estimate
from arena.rating.lines import count_text, unshown_text, votes_text
from arena.rating.rules import Unit
from arena.rating.snapshot_document import Trust
from arena.results.exports.tables import method_text
from arena.results.queries.votes import REASONS, Filters, select_counted_votes
from arena.studies.services.opening import preregistration_sha256
from augment.errors import Conflict
from augment.services.scenarios import type_label

BLANK = "[BLANK]"
"""What authors have to fill in."""
CRITERIA = {
    Question.INSTRUCTION: {
        "quality": "Correctness",
        "aspect": "Content of outputs",
        "frame": "Relative to the input: the scene and its instruction",
        "effect": "Intrinsic",
    }
}
"""Section 4 of HEDS where the question itself answers it; what realism or difficulty means is for
authors to say."""


def read_methods(snapshot: Snapshot) -> dict[str, Any]:
    """Return the values for the templates of a rating's methods.

    Raises:
        Conflict: Its study has no preregistration, as those of votes from elsewhere.
    """
    study = snapshot.study
    if not study.preregistration:
        raise Conflict(f"'{study.name}' has no preregistration, so nobody knows how it was held.")
    frozen = json.loads(study.preregistration)
    counts = set(Counter(entry["contestant"] for entry in frozen["pictures"]).values())
    left_out = sorted(snapshot.votes_left_out.items())
    key = snapshot.question or study.questions[0]
    return {
        "study": study,
        "snapshot": snapshot,
        "board": snapshot.results.board,
        "simulated": snapshot.includes_simulated,
        "made_up": select_counted_votes(snapshot).filter(is_simulated=True).exists(),
        "contestants": len(frozen["contestants"]),
        "made_up_contestants": sum(row.is_simulated for row in study.contestants.all()),
        "scenarios": snapshot.results.board.scenarios or len(frozen["scenarios"]),
        "languages": [
            LANG_INFO.get(code, {}).get("name", code)
            for code in sorted(set(study.scenarios.values_list("language", flat=True)))
        ],
        "outputs": [str(count) for count in sorted({min(counts), max(counts)})],
        "plan": _tell_plan(snapshot, frozen),
        "product": frozen["product"]["version"],
        "quality": _tell_quality(snapshot),
        "key": key,
        "criterion": CRITERIA.get(Question(key), {}),
        "question": str(Question(key).label),
        "method": method_text(snapshot)
        + ", an early look: the study was still open" * snapshot.is_early,
        "votes": votes_text(snapshot.votes_cast, snapshot.settled_ties),
        "left_out": ", ".join(f"{number} {REASONS[why]}" for why, number in left_out) or "none",
        "agreement": _tell_agreement(snapshot.results.trust),
        "tests": _tell_tests(snapshot),
        "preregistration": preregistration_sha256(study),
    }


def methods_json(methods: dict[str, Any]) -> bytes:
    """Return the sheet: every question of HEDS, with null where authors have to answer."""
    lines = _render("results/heds.txt", methods).splitlines()
    cells = ([part.strip() for part in line.split(" |", 2)] for line in lines)
    questions = [
        {"number": number, "question": text, "answer": answer or None}
        for number, text, answer in cells
    ]
    head = {
        "format": "scenario-arena/methods",
        "version": 1,
        "form": "Human Evaluation Datasheet (Shimorina and Belz 2022)",
        "study": methods["study"].name,
        "rating": str(methods["snapshot"].code),
        "simulated": methods["simulated"],
        "early": methods["snapshot"].is_early,
    }
    blank = [line["number"] for line in questions if line["answer"] is None]
    versions = dict(sorted(methods["snapshot"].versions.items()))  # PostgreSQL has its own order
    return json_bytes(head | {"questions": questions, "blank": blank, "versions": versions})


def methods_latex(methods: dict[str, Any]) -> bytes:
    """Return a paragraph for a paper; blanks are bold."""
    rating, versions = methods["snapshot"], methods["snapshot"].versions
    comments = [f"{methods['study'].name}, rating {rating.code}"]
    comments += ["Simulated: the numbers say nothing of any contestant."] * methods["simulated"]
    comments += [", ".join(f"{name} {version}" for name, version in sorted(versions.items()))]
    texts = {name: escape(value) for name, value in methods.items() if isinstance(value, str)}
    texts |= {"blank": rf"\textbf{{{escape(BLANK)}}}"}
    head = "".join(f"% {escape(comment)}\n" for comment in comments)
    return (head + _render("results/methods.tex", methods | texts)).encode()


METHODS_FORMATS = formats(latex=methods_latex, json=methods_json)


# --- Private -----------------------------------------------------------------------------------


def _render(name: str, methods: dict[str, Any]) -> str:
    """Return a template as plain text."""
    template = get_template(name).template  # type: ignore[attr-defined]
    return str(template.render(Context(methods, autoescape=False)))


def _tell_plan(snapshot: Snapshot, frozen: dict[str, Any]) -> str:
    plan = (
        f"A balanced plan ({frozen['product']['planner']}, seed {frozen['seed']}) chose pairs and "
        f"sides before the first vote, {count_text(snapshot.study.votes_per_expert, 'pair|')} for "
        f"each of {count_text(frozen['experts'], 'account|')}"
    )
    if challengers := frozen["rules"].get("challengers"):
        plan += f", every pair with {' or '.join(challengers)}"
    if later := snapshot.study.matchups.filter(batch__gt=0, kind=MAIN).count():
        plan += f"; {later} more were planned later, for who came by a link or took over"
    filters = Filters.of_document(snapshot.filters)
    if settled := len(frozen["rules"].get("identical", ())):
        ties = "" if filters.leave_out_settled else "ties, each as often as others on average"
        plan += f"; {unshown_text(settled, ties)}"
    if filters.types:
        plan += f"; rated are only these types: {', '.join(map(type_label, filters.types))}"
    if filters.experts:
        plan += f"; rated are only votes of {count_text(len(filters.experts), 'chosen expert|')}"
    return plan


def _tell_quality(snapshot: Snapshot) -> str:
    numbers = Counter(snapshot.study.matchups.values_list("kind", flat=True))
    kinds = {REPEAT: "hidden repeat|", CHECK: "attention check|"}
    used = [count_text(numbers[kind], name) for kind, name in kinds.items() if numbers[kind]]
    if not used:
        return "There were no hidden repeats or attention checks"
    rated = numbers[REPEAT] and REPEAT in Filters.of_document(snapshot.filters).kinds
    how = "the repeats are rated as well" if rated else "they are not rated"
    return f"On top came {' and '.join(used)}; {how}, and no vote is removed by them"


def _tell_tests(snapshot: Snapshot) -> str:
    board = snapshot.results.board
    if board.above is None:
        why = "the intervals do not know how votes are clustered"
        if board.seems_above is not None or 1 in (board.experts, board.scenarios):
            why = "too few experts or scenarios judged"
        elif snapshot.resampling_unit == Unit.TWO_WAY:
            why = "the votes bound no rating"
        return f"Differences of pairs are not tested: {why}"
    number, pairs = len(board.above), len(board.p_values or ())
    all_are = f"All {pairs} pairs are" if pairs else "All pairs are"
    tested = "The one pair is tested" if pairs == 1 else f"{all_are} tested at once"
    return f"{tested}, at an error of 5 % for the table; {number} differ{'s' * (number == 1)}"


def _tell_agreement(trust: Trust) -> str:
    parts = []
    if trust.agreement and trust.agreement.units:
        on = count_text(trust.agreement.units, "pair| that several experts judged")
        parts.append(f"Krippendorff's alpha (nominal) is {_text(trust.agreement.alpha)} on {on}")
    if trust.repeats is not None:
        of = count_text(trust.repeats.number, "hidden repeat|")
        parts.append(f"Of {of} a share of {_text(trust.repeats.same)} was answered alike")
    return ". ".join(parts) or "Agreement was not measured: no pair was judged twice"


def _text(estimate: Estimate) -> str:
    """Return a value with its interval, as far as the votes determine them."""
    if estimate.value is None:
        return "undetermined"
    if estimate.lower is None or estimate.upper is None:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} (95 % interval {estimate.lower:.2f} to {estimate.upper:.2f})"
