"""Hypotheses on a study, written down before its first vote, and their answers."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple, Self

from arena.errors import NothingToPlan
from arena.models import Question, Snapshot, Study
from arena.pairing.rules import MOST_CHECKS, MOST_OVERLAP, MOST_REPEATS
from arena.voting.services.pictures import SampleRule
from augment.services import InputKind, input_field, to_inputs

MOST = 100
LONGEST = 500
_PAIR = re.compile(r"(\S+)\s+above\s+(\S+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """A line that was written down before the first vote.

    Attributes:
        text: As it was entered.
        above: The slugs of the one that is expected to be better and of the other; None for a
            line in words, which no number answers.
    """

    text: str
    above: tuple[str, str] | None = None


class HypothesisVerdict(StrEnum):
    """Answer of a rating about an expected pair, with all pairs of the table judged at once."""

    HELD = "held"
    CONTRADICTED = "contradicted"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True, slots=True, kw_only=True)
class HypothesisAnswer:
    """A hypothesis and what came of it.

    Attributes:
        verdict: None for a line in words.
        difference: Points from the other to the one expected to be better; None where they are
            not rated together.
        p: Adjusted for all pairs of the table.
    """

    hypothesis: Hypothesis
    verdict: HypothesisVerdict | None = None
    difference: float | None = None
    p: float | None = None


def read_hypotheses(lines: Sequence[str], contestants: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Read lines of text; “SLUG above SLUG” alone on a line is an expected pair.

    Args:
        lines: Empty ones are skipped.
        contestants: Slugs of the study.

    Raises:
        NothingToPlan: A pair names somebody else or somebody twice, a line is too long or comes
            twice, or there are too many.
    """
    texts = [" ".join(line.split()) for line in lines if line.strip()]
    if (
        len(texts) > MOST
        or len(set(texts)) < len(texts)
        or max(map(len, texts), default=0) > LONGEST
    ):
        raise NothingToPlan(
            f"At most {MOST} hypotheses of at most {LONGEST} signs, each once, are allowed."
        )
    hypotheses = []
    for text in texts:
        match = _PAIR.fullmatch(text)
        above = None if match is None else (match[1], match[2])
        if above and (above[0] == above[1] or not set(above) <= set(contestants)):
            raise NothingToPlan(
                f"“{text}”: it takes two of the contestants {', '.join(sorted(contestants))}."
            )
        hypotheses.append(Hypothesis(text=text, above=above))
    return tuple(hypotheses)


def frozen_hypotheses(study: Study) -> tuple[Hypothesis, ...]:
    """Return the hypotheses that were frozen at the opening."""
    return tuple(
        Hypothesis(text=stored["text"], above=stored["above"] and tuple(stored["above"]))
        for stored in study.rules.get("hypotheses", ())
    )


def answer_hypotheses(snapshot: Snapshot) -> tuple[HypothesisAnswer, ...]:
    """Return the answers of a rating to the study's hypotheses, on its primary question."""
    if snapshot.question != snapshot.study.questions[0]:
        return ()
    ratings = dict(snapshot.standings.values_list("slug", "rating"))
    board = snapshot.results.board
    p_values = {frozenset((pair.a, pair.b)): pair.p for pair in board.p_values or ()}
    answers = []
    for hypothesis in frozen_hypotheses(snapshot.study):
        if hypothesis.above is None:
            answers.append(HypothesisAnswer(hypothesis=hypothesis))
            continue
        high, low = (ratings.get(slug) for slug in hypothesis.above)
        if len({board.parts.get(slug) for slug in hypothesis.above}) > 1:
            high = None
        answers.append(
            HypothesisAnswer(
                hypothesis=hypothesis,
                verdict=_verdict(hypothesis.above, board.above),
                difference=None if high is None or low is None else high - low,
                p=p_values.get(frozenset(hypothesis.above)),
            )
        )
    return tuple(answers)


def _verdict(
    pair: tuple[str, str], above: Collection[tuple[str, str]] | None
) -> HypothesisVerdict:
    if above is None:
        return HypothesisVerdict.NOT_JUDGED
    if pair in above:
        return HypothesisVerdict.HELD
    is_other_way = (pair[1], pair[0]) in above
    return HypothesisVerdict.CONTRADICTED if is_other_way else HypothesisVerdict.UNDECIDED


# --- What is asked for -------------------------------------------------------------------------

LONGEST_NAME = 120
HIGHEST_SEED = 2**63 - 1
SAMPLES = {SampleRule.ONE.value: "one of each scenario", SampleRule.ALL.value: "all of them"}


def _percent(label: str, help: str, *, most: float, default: float = 0.0) -> Any:
    return input_field(
        InputKind.NUMBER, label, help, unit="%", least=0, most=round(100 * most), default=default
    )


def _switch(label: str, help: str, *, default: bool = False) -> Any:
    return input_field(InputKind.SWITCH, label, help, default=default)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPlan:
    """A study that is to be opened; see arena.pairing.rules for what its rules mean."""

    name: str = input_field(
        InputKind.TEXT, "Name", "Experts see it: it should name no contestant.", most=LONGEST_NAME
    )
    contestants: tuple[str, ...] = input_field(
        InputKind.NAMES, "Contestants", "Slugs; the latest picture of each scenario takes part."
    )
    scenarios: tuple[str, ...] = input_field(InputKind.NAMES, "Scenarios", "Slugs.")
    experts: tuple[str, ...] = input_field(InputKind.NAMES, "Experts", "Usernames.")
    votes_per_expert: int = input_field(InputKind.WHOLE, "Votes per expert", least=1, most=10_000)
    seed: int = input_field(
        InputKind.WHOLE, "Seed of the plan", default=1, least=0, most=HIGHEST_SEED
    )
    repeats: float = _percent(
        "Hidden repeats",
        "On top of the votes, sides swapped, never rated: they tell how steady each expert is.",
        most=MOST_REPEATS,
        default=5.0,
    )
    checks: float = _percent(
        "Attention checks",
        "A broken picture against the reference, never rated. Each needs a scenario with a "
        "reference; have the missing ones drawn first.",
        most=MOST_CHECKS,
    )
    overlap: float = _percent(
        "Pairs that two experts judge",
        "At least so many of the judged pairs go to two experts or more, else nobody can say how "
        "far they agree.",
        most=MOST_OVERLAP,
    )
    hypotheses: tuple[str, ...] = input_field(
        InputKind.LINES,
        "Hypotheses",
        "Lines that are frozen with the study. “reference above rule-placer” alone on a line is "
        "answered by the results.",
        default=(),
    )
    questions: tuple[str, ...] = input_field(
        InputKind.NAMES,
        "Questions about each pair",
        f"Out of {', '.join(Question.values)}; the first one is the primary question. Only which "
        "carries out the instruction better unless given.",
        default=(),
    )
    samples: SampleRule = input_field(
        InputKind.CHOICE,
        "Where a job has several samples",
        "One is drawn by the seed, the same for all contestants; all are shown each on its own.",
        choices=SAMPLES,
        default=SampleRule.ONE,
    )
    jobs: tuple[str, ...] = input_field(
        InputKind.NAMES,
        "Jobs",
        "Names or codes of the jobs whose augmentations are shown; none for the latest of all.",
        default=(),
    )
    allow_both_miss: bool = _switch(
        "Ask whether both miss",
        "Experts may add to Equal that both miss the instruction; it counts as a tie.",
    )
    ask_strength: bool = _switch(
        "Ask how clear a preference is",
        "Experts say slightly or clearly. The order is rated without it; a cross-check is shown.",
    )
    ask_why: bool = _switch(
        "Ask what is wrong",
        "Experts may click an object of either image and say position, heading or logic.",
    )
    show_alike: bool = _switch(
        "Also show pairs that nobody can tell apart",
        "Pairs that differ by at most 0.1 m, 0.1 s and 10° in every object otherwise count as "
        "ties and are not shown, but for a tenth that is shown as a check.",
    )
    allow_replay: bool = _switch(
        "Experts may play the drives",
        "Under the images, how a planner drove both scenes; only where every image of a scenario "
        "was driven. Votes say who played them.",
    )
    hide_rings: bool = _switch(
        "No rings round the ego",
        "Experts otherwise see how far 10, 20 and 30 m are in both images.",
    )
    show_ticks: bool = _switch(
        "A tick at each distance that the sentence names",
        "On the ego’s lane, in both images alike; it turns judging into reading off, and each "
        "vote keeps it as an aid.",
    )
    practice: bool = _switch(
        "Practice before the first pair",
        "For whoever came by a link: five pairs, a reference beside a broken image, each followed "
        "by what was right; nothing of it counts. Only where scenarios have both images drawn.",
        default=True,
    )
    allow_simulated: bool = _switch("Simulated may take part", "Every page and file then says so.")

    @classmethod
    def read(cls, entered: Mapping[str, Any]) -> Self:
        """Make a plan of what an entry point has parsed: lists, and words for choices."""
        values: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in entered.items()
        }
        return cls(**values | {"samples": SampleRule(entered.get("samples", SampleRule.ONE))})

    @property
    def shares(self) -> dict[str, Any]:
        """The percentages as the planner takes them, by its names."""
        return {share: getattr(self, name) / 100 for name, share in SHARES.items()}


PLAN_INPUTS = to_inputs(StudyPlan)
QUANTITIES = ("votes_per_expert", "repeats", "checks", "overlap")
"""What decides how many pairs each expert sees."""
SHARES = {"repeats": "repeat_share", "checks": "check_share", "overlap": "overlap_share"}
"""What the frozen rules call a percentage; they keep it as a share."""
_COLUMNS = {column.name for column in Study._meta.fields}
SWITCHES = tuple(field.name for field in PLAN_INPUTS if field.kind is InputKind.SWITCH)
SWITCH_COLUMNS = tuple(name for name in SWITCHES if name in _COLUMNS)
"""Switches that a study keeps in a column of its own; the others are among its rules."""
SWITCH_RULES = tuple(name for name in SWITCHES if name not in _COLUMNS)


class Preset(NamedTuple):
    """Values of a StudyPlan that go together; everything else keeps its default.

    Attributes:
        help: What it is for.
        quantities: By the fields of StudyPlan.
    """

    label: str
    help: str
    quantities: dict[str, float]


PRESETS = {
    "pilot": Preset(
        "Pilot",
        "A first look: few votes, many of them on pairs that two experts judge.",
        {"votes_per_expert": 20, "repeats": 0.0, "checks": 0.0, "overlap": 30.0},
    ),
    "paper": Preset(
        "Paper",
        "A table to publish: agreement and steadiness of the experts can be reported.",
        {"votes_per_expert": 40, "repeats": 5.0, "checks": 2.0, "overlap": 10.0},
    ),
    "crowd": Preset(
        "Crowd",
        "Many voters whom you don’t know: more checks and repeats for each of them.",
        {"votes_per_expert": 30, "repeats": 10.0, "checks": 10.0, "overlap": 0.0},
    ),
}


def read_opened_plan(study: Study) -> StudyPlan:
    """Return the plan of an opened study, from its frozen fields.

    Who joined by a link for everybody, and hidden pairs handed over, are no part of it.
    """
    rules = study.rules
    return StudyPlan(
        name=study.name,
        contestants=tuple(study.contestants.order_by("slug").values_list("slug", flat=True)),
        scenarios=tuple(study.scenarios.order_by("slug").values_list("slug", flat=True)),
        experts=tuple(rules.get("experts", ())),
        votes_per_expert=study.votes_per_expert,
        seed=study.seed,
        hypotheses=tuple(hypothesis.text for hypothesis in frozen_hypotheses(study)),
        samples=SampleRule(rules.get("samples", SampleRule.ONE)),
        questions=tuple(study.questions),
        jobs=tuple(job["code"] for job in rules.get("jobs", ())),
        **{name: bool(rules.get(name)) for name in SWITCH_RULES},
        **{name: round(100 * rules.get(share, 0), 6) for name, share in SHARES.items()},
        **{name: getattr(study, name) for name in SWITCH_COLUMNS},
    )
