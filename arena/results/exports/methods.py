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
from arena.pairing.order import MAIN
from arena.rating.comparisons import Estimate
from arena.rating.lines import count_text, votes_text
from arena.rating.rules import Unit
from arena.rating.snapshot_document import Trust
from arena.results.exports.tables import method_text
from arena.results.queries.votes import REASONS, Filters, select_counted_votes
from arena.studies.services.opening import preregistration_sha256
from augment.errors import Conflict

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
        "quality": _tell_quality(frozen["rules"]),
        "key": key,
        "criterion": CRITERIA.get(Question(key), {}),
        "question": str(Question(key).label),
        "method": method_text(snapshot),
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
    settled = len(frozen["rules"].get("identical", ()))
    if not settled:
        return plan
    is_left_out = Filters.of_document(snapshot.filters).leave_out_settled
    counted = (
        "are left out" if is_left_out else "count as ties, each as often as others on average"
    )
    return f"{plan}; {settled} pairs that nobody can tell apart were not shown and {counted}"


def _tell_quality(rules: dict[str, Any]) -> str:
    shares = {"hidden repeats": "repeat_share", "attention checks": "check_share"}
    used = [
        f"{100.0 * rules[share]:.0f} % {name}"
        for name, share in shares.items()
        if rules.get(share)
    ]
    if not used:
        return "There were no hidden repeats or attention checks"
    return f"On top came {' and '.join(used)}; they are not rated, and no vote is removed by them"


def _tell_tests(snapshot: Snapshot) -> str:
    board = snapshot.results.board
    if board.above is None:
        why = "the intervals do not know how votes are clustered"
        if board.seems_above is not None or 1 in (board.experts, board.scenarios):
            why = "too few experts or scenarios judged"
        elif snapshot.resampling_unit == Unit.TWO_WAY:
            why = "the votes bound no rating"
        return f"Differences of pairs are not tested: {why}"
    number = len(board.above)
    if board.p_values is None:
        tested = "All pairs are tested at once"
    elif len(board.p_values) == 1:
        tested = "The one pair is tested"
    else:
        tested = f"All {len(board.p_values)} pairs are tested at once"
    return f"{tested}, at an error of 5 % for the table; {number} differ{'s' * (number == 1)}"


def _tell_agreement(trust: Trust) -> str:
    parts = []
    if trust.agreement and trust.agreement.units:
        alpha, units = _text(trust.agreement.alpha), trust.agreement.units
        on = count_text(units, "pair| that several experts judged")
        parts.append(f"Krippendorff's alpha (nominal) is {alpha} on {on}")
    if trust.repeats is not None:
        number, same = trust.repeats.number, _text(trust.repeats.same)
        parts.append(f"Of {number} hidden repeats a share of {same} was answered alike")
    return ". ".join(parts) or "Agreement was not measured: no pair was judged twice"


def _text(estimate: Estimate) -> str:
    """Return a value with its interval, as far as the votes determine them."""
    if estimate.value is None:
        return "undetermined"
    if estimate.lower is None or estimate.upper is None:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} (95 % interval {estimate.lower:.2f} to {estimate.upper:.2f})"
