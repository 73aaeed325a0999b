"""The methods of a study for a paper: a paragraph, and a sheet in the form of HEDS.

HEDS is Shimorina and Belz's Human Evaluation Datasheet (2022); numbers are those of its questions.
Answers come from the preregistration and the rating. What neither says is blank, never guessed.
The words are in templates/results/heds.txt and methods.tex.
"""

import json
from collections import Counter
from typing import Any

from django.template import Context
from django.template.loader import get_template

from arena.exports.formats import formats, json_bytes
from arena.exports.latex import escape
from arena.models import Question, Snapshot
from arena.rating.comparisons import Estimate
from arena.rating.lines import votes_text
from arena.rating.snapshot_document import Trust
from arena.results.exports.tables import method_text
from arena.studies.services.opening import preregistration_sha256
from augment.errors import Conflict

BLANK = "[BLANK]"
"""What authors have to fill in."""


def read_methods(snapshot: Snapshot) -> dict[str, Any]:
    """Return what templates say of a rating's methods.

    Raises:
        Conflict: Its study has no preregistration, as those of votes from elsewhere.
    """
    study = snapshot.study
    if not study.preregistration:
        raise Conflict(f"'{study.name}' has no preregistration, so nobody knows how it was held.")
    frozen = json.loads(study.preregistration)
    counts = set(Counter(entry["contestant"] for entry in frozen["pictures"]).values())
    shares = {"hidden repeats": "repeat_share", "attention checks": "check_share"}
    used = [
        f"{100.0 * frozen['rules'][share]:.0f} % {name}"
        for name, share in shares.items()
        if frozen["rules"].get(share)
    ]
    left_out = sorted(snapshot.votes_left_out.items())
    key = snapshot.question or study.questions[0]
    return {
        "study": study,
        "snapshot": snapshot,
        "board": snapshot.results.board,
        "simulated": snapshot.includes_simulated,
        "contestants": len(frozen["contestants"]),
        "scenarios": len(frozen["scenarios"]),
        "languages": sorted(set(study.scenarios.values_list("language", flat=True))),
        "outputs": [str(count) for count in sorted({min(counts), max(counts)})],
        "plan": f"A balanced plan ({frozen['product']['planner']}, seed {frozen['seed']}) chose "
        f"pairs and sides before the first vote, {study.votes_per_expert} pairs for each of "
        f"{frozen['experts']} accounts; {len(frozen['rules'].get('identical', ()))} pairs that "
        "nobody can tell apart count as ties",
        "product": frozen["product"]["version"],
        "quality": f"{' and '.join(used) or 'No hidden repeats or attention checks'}, never "
        "rated; no vote is removed by them",
        "key": key,
        "question": str(Question(key).label),
        "method": method_text(snapshot),
        "votes": votes_text(snapshot.votes_cast, snapshot.settled_ties),
        "left_out": ", ".join(f"{number} {reason}" for reason, number in left_out) or "none",
        "agreement": _tell_agreement(snapshot.results.trust),
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
    versions = methods["snapshot"].versions
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


def _tell_agreement(trust: Trust) -> str:
    parts = []
    if trust.agreement is not None:
        alpha, units = _text(trust.agreement.alpha), trust.agreement.units
        parts.append(f"Krippendorff's alpha (nominal) is {alpha} on {units} shared pairs")
    if trust.repeats is not None:
        number, same = trust.repeats.number, _text(trust.repeats.same)
        parts.append(f"Of {number} hidden repeats a share of {same} was answered alike")
    return "; ".join(parts) or "Agreement was not measured: no pair was judged twice"


def _text(estimate: Estimate) -> str:
    """Return a value with its interval, as far as the votes determine them."""
    if estimate.value is None:
        return "undetermined"
    if estimate.lower is None or estimate.upper is None:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} (95 % {estimate.lower:.2f} to {estimate.upper:.2f})"
