"""Judge models' answers about a study's pairs. They are no experts: no rating counts them."""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from django.db.models import Count, F, Q, QuerySet, Sum
from django.db.models.functions import Coalesce

from arena.models import Matchup, Study
from arena.results.queries.votes import COUNTED, Filters, current_votes, last_vote_id
from arena.voting.queries.blinding import is_imported
from augment.models import Contestant, JudgeRun, ModelCall, PairJudgement
from augment.services.endpoints import vendor_family
from augment.services.running import Exchange, ShownPair, combine_answers, exchange

State = PairJudgement.State

WITHOUT_FAMILY = ", without its own family"
"""Behind the name of a judge whose pairs with contestants of its own family are left out."""

Preferences = Mapping[tuple[str, str], int]
"""By the codes of two augmentations, left and right: 1 left is better, 0 tie, -1 right is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgeLine:
    """Summary of one judge.

    Attributes:
        name: Says as well whether it is the simulated stand-in.
        states: How many pairs are in each state.
        kept, lost, equal: Pairs whose preference survived the exchange, did not, or was none.
        unreadable: Pairs with an answer that nobody could read; ties, like those two.
        answers: Single answers that prefer a picture, and `first` those that prefer picture A.
        usd: What one pair cost, in both orders; None where a price is unknown.
        own_family: Names of contestants that use a model of the judge's own family.
    """

    run: JudgeRun
    name: str
    states: Mapping[str, int]
    kept: int
    lost: int
    equal: int
    unreadable: int
    answers: int
    first: int
    usd: float | None
    own_family: tuple[str, ...]

    @property
    def pairs(self) -> int:
        """All that it is asked about."""
        return sum(self.states.values())

    @property
    def done(self) -> int:
        """Pairs with both answers."""
        return self.states.get(State.DONE, 0)

    @property
    def failed(self) -> int:
        """Pairs that broke on the way to the model."""
        return self.states.get(State.FAILED, 0)

    @property
    def first_share(self) -> float | None:
        """The share of preferences for what came first; 0.5 without a bias of position."""
        return self.first / self.answers if self.answers else None


def list_judged_pairs(study: Study, question: str) -> list[ShownPair]:
    """Return the main pairs on which votes of experts count, each once, as it was first shown."""
    if is_imported(study):
        return []
    votes = current_votes(study, Filters(question=question), last_vote_id(study))
    shown = {vote.matchup for vote in votes if vote.mark == COUNTED and vote.matchup is not None}
    rows = Matchup.objects.select_related("left", "right").only(
        *("left_image", "right_image", "left__image", "right__image")
    )
    pairs: dict[frozenset[int], ShownPair] = {}
    for _, row in sorted(rows.in_bulk(list(shown)).items()):
        images = row.left_image or row.left.image, row.right_image or row.right.image
        pair = ShownPair(row.left_id, row.right_id, *images)
        pairs.setdefault(frozenset((row.left_id, row.right_id)), pair)
    return list(pairs.values())


def judge_lines(study: Study) -> list[JudgeLine]:
    """Return a line for each judge of a study, the newest first."""
    lines = []
    for run in study.judges.select_related("endpoint").order_by("-pk"):
        rows = list_answered_pairs(run)
        became = Counter(exchange(row.first, row.second) for row in rows)
        single = Counter(answer for row in rows for answer in (row.first, row.second))
        states = run.judgements.order_by().values_list("state").annotate(Count("pk"))
        line = JudgeLine(
            run=run,
            name=judge_name(run),
            states=dict(states),
            kept=became[Exchange.KEPT],
            lost=became[Exchange.LOST],
            equal=became[Exchange.EQUAL],
            unreadable=became[Exchange.UNREADABLE],
            answers=single["A"] + single["B"],
            first=single["A"],
            usd=_usd_per_pair(run, len(rows)),
            own_family=tuple(_own_family(study, run).values()),
        )
        lines.append(line)
    return lines


def judge_preferences(study: Study, question: str) -> dict[str, Preferences]:
    """Return each judge's preferences by its name; of a pair the newest answer.

    A run that was cut short hides no answer of an earlier one that showed as many frames.
    Where contestants ask a model of the judge's own family, it comes once more without them.
    """
    preferences: dict[str, Preferences] = {}
    answered: dict[tuple[str, int], dict[frozenset[int], PairJudgement]] = {}
    frames: dict[str, int] = {}
    runs = study.judges.filter(question=question).select_related("endpoint")
    for run in runs.order_by("-pk"):
        name = judge_name(run)
        by_pair = answered.setdefault((name, run.frames), {})
        for row in list_answered_pairs(run):
            by_pair.setdefault(frozenset((row.left_id, row.right_id)), row)
        if not by_pair or frames.setdefault(name, run.frames) != run.frames:
            continue
        rows, own = [*by_pair.values()], {*_own_family(study, run)}
        preferences[name] = _preferences(rows)
        if own:
            preferences[name + WITHOUT_FAMILY] = _preferences(rows, without=own)
    return preferences


def judge_name(run: JudgeRun) -> str:
    """Return how tables call a judge."""
    return f"Judge {run}{' (simulated)' if run.endpoint.is_simulated else ''}"


def list_models(contestant: Contestant) -> list[str]:
    """Return the models that a contestant asks, in any role, or that its card names."""
    models = [contestant.model, *(role["model"] for role in contestant.roles.values())]
    if contestant.card is not None:
        models += contestant.card["models"]
    return [model for model in models if model]


def list_answered_pairs(run: JudgeRun) -> list[PairJudgement]:
    """Return the pairs with both answers, with their contestants and scenarios."""
    rows: QuerySet[PairJudgement] = run.judgements.filter(state=State.DONE).order_by("pk")
    return list(
        rows.select_related("left__contestant", "right__contestant", "left__scenario").only(
            *("first", "second", "first_reason", "second_reason", "left__code", "right__code"),
            *("left__contestant__slug", "right__contestant__slug", "left__scenario__slug"),
        )
    )


# --- Private -----------------------------------------------------------------------------------


def _usd_per_pair(run: JudgeRun, pairs: int) -> float | None:
    """Return the cost of a pair; an answer from the store counts at its original cost."""
    calls = ModelCall.objects.filter(
        Q(sent_at__isnull=False) | Q(served_from__isnull=False), judgement__run=run
    ).exclude(served_from__judgement=F("judgement"))  # a second worker's copy of the first's
    money = Coalesce("served_from__cost_nano_usd", "cost_nano_usd")
    sums = calls.aggregate(calls=Count("pk"), known=Count(money), money=Sum(money))
    if not pairs or sums["known"] < sums["calls"]:
        return None
    return float(sums["money"] or 0) / 1e9 / pairs


def _own_family(study: Study, run: JudgeRun) -> dict[str, str]:
    """Return names of the contestants, by slug, that use a model of the judge's family."""
    family = vendor_family(run.model)
    return {
        row.slug: row.name
        for row in study.contestants.order_by("name")
        if family in map(vendor_family, list_models(row))
    }


def _preferences(
    rows: list[PairJudgement], without: Collection[str] = ()
) -> dict[tuple[str, str], int]:
    return {
        (str(row.left.code), str(row.right.code)): combine_answers(row.first, row.second)
        for row in rows
        if not {row.left.contestant.slug, row.right.contestant.slug} & {*without}
    }
