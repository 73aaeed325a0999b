"""What a job may cost, before it is launched: from what its contestants used, else a guess."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from decimal import ROUND_UP, Decimal

from django.db.models import Avg, Count, Exists, OuterRef, Q, Sum

from augment.llm.costs import Price, usd_of, worst_case
from augment.llm.messages import Request
from augment.models import Augmentation, Contestant, Endpoint, Event, ModelCall, Scenario
from augment.prompts.fill import prompt_version
from augment.scene.entities import Modification
from augment.services.endpoints.known_models import price_of
from augment.services.endpoints.treatments import Respondent, options_of, respondents_of
from augment.services.scenarios.scenes import reference_of, scene_of
from augment.variants.options import recipe_with
from augment.variants.recipes import Recipe, find_recipe
from augment.variants.respondents import ModelRole
from augment.variants.showing import TokenUse, calls_of, most_tokens, shown_prompt

Spell = tuple[datetime | None, datetime | None]
"""From when until when; None where it has no such end."""


def spells_at_address(endpoints: Sequence[Endpoint]) -> dict[str, list[Spell]]:
    """By label, when an endpoint had its address; only those that were ever moved are in it."""
    codes = {str(row.code): row for row in endpoints}
    changes = Event.objects.filter(
        object_kind="endpoint", object_code__in=codes, verb="change"
    ).order_by("at", "pk")
    moves: dict[str, list[tuple[datetime, str, str]]] = defaultdict(list)
    for code, at, before, after in changes.values_list("object_code", "at", "before", "after"):
        left, taken = _address(before), _address(after)
        if left != taken:
            moves[code].append((at, left, taken))
    return {codes[code].label: _spells(codes[code], found) for code, found in moves.items()}


# --- Private -----------------------------------------------------------------------------------


def _spells(endpoint: Endpoint, moves: Sequence[tuple[datetime, str, str]]) -> list[Spell]:
    wanted = endpoint.base_url.rstrip("/")
    found: list[Spell] = []
    since: datetime | None = None
    for at, left, _ in moves:
        if left == wanted:
            found.append((since, at))
        since = at
    if moves[-1][2] == wanted:
        found.append((since, None))
    return found


def _address(facts: object) -> str:
    """The address in what the log keeps of an endpoint; two are one but for a slash at the end."""
    return str(facts.get("base_url", "")).rstrip("/") if isinstance(facts, dict) else ""


GUESSED_LATENCY_S = 10.0
"""Of a call to a model that nobody has asked yet: a guess."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Latency:
    """How long a call to a contestant's model takes.

    Attributes:
        mean_s: Of one call.
        calls: So many recorded ones it rests on; 0 for a guess.
    """

    mean_s: float
    calls: int


def count_answered(
    contestants: Sequence[Contestant], scenarios: Sequence[str], *, samples: int
) -> Counter[int]:
    """By contestant, how many of a job's cells it has answered before with the installed prompts.

    Their requests are the same, so their answers come from the store and cost nothing. What was
    answered at another address than an endpoint has now is asked anew.
    """
    stored = [row for row in contestants if row.pk is not None]
    found: Counter[int] = Counter()
    for when, group in _by_address(stored):
        asked = ModelCall.objects.filter(
            when,
            attempt__augmentation=OuterRef("pk"),
            answer__isnull=False,
            prompt_version=prompt_version(),
        )
        cells = (
            Augmentation.objects.order_by()
            .filter(
                contestant__in=group,
                scenario__slug__in=scenarios,
                sample__lte=samples,
                state__in=Augmentation.SHOWABLE,
            )
            .filter(Exists(asked))
            .values_list("contestant_id", "scenario_id", "sample")
            .distinct()
        )
        found.update(contestant for contestant, _, _ in cells)
    return found


def latency_of(contestant: Contestant) -> Latency:
    """From all recorded calls to its model at its endpoint, whoever asked."""
    calls = ModelCall.objects.filter(
        attempt__augmentation__contestant__endpoint=contestant.endpoint,
        attempt__augmentation__contestant__model=contestant.model,
        latency_s__isnull=False,
    ).aggregate(mean=Avg("latency_s"), number=Count("pk"))
    if not calls["number"]:
        return Latency(mean_s=GUESSED_LATENCY_S, calls=0)
    return Latency(mean_s=calls["mean"], calls=calls["number"])


def seconds_for(load: Sequence[tuple[Contestant, int, Latency]]) -> float:
    """How long calls take where every endpoint is kept as busy as its limits allow.

    Args:
        load: Contestants with their calls and how long one takes. Endpoints work side by side.
    """
    busy: defaultdict[int, float] = defaultdict(float)
    starts: defaultdict[int, int] = defaultdict(int)
    longest = 0.0
    for contestant, calls, latency in load:
        site = contestant.endpoint
        if site is None:
            continue
        busy[site.pk] += calls * latency.mean_s / site.max_concurrency
        starts[site.pk] += calls
        paced = 60.0 * starts[site.pk] / (site.requests_per_minute or float("inf"))
        longest = max(longest, busy[site.pk], paced)
    return longest


# --- Private -----------------------------------------------------------------------------------


def _by_address(contestants: Sequence[Contestant]) -> list[tuple[Q, list[int]]]:
    """Contestants by when their endpoints had the addresses that they have now."""
    labels = {role["endpoint"] for row in contestants for role in row.roles.values()}
    used = Q(label__in=labels) | Q(pk__in={row.endpoint_id for row in contestants})
    endpoints = {row.label: row for row in Endpoint.objects.filter(used)}
    spells = spells_at_address(list(endpoints.values()))
    groups: dict[frozenset[str], list[int]] = defaultdict(list)
    for row in contestants:
        own = [] if row.endpoint is None else [row.endpoint.label]
        asked = {*own, *(role["endpoint"] for role in row.roles.values())}
        groups[frozenset(asked & spells.keys())].append(row.pk)
    return [(_within([spells[name] for name in moved]), pks) for moved, pks in groups.items()]


def _within(spells: Iterable[Sequence[Spell]]) -> Q:
    """Calls that began in one spell of each."""
    found = Q()
    for several in spells:
        either = Q(pk__in=[])
        for since, until in several:
            one = Q() if since is None else Q(started_at__gte=since)
            either |= one if until is None else one & Q(started_at__lt=until)
        found &= either
    return found


ANSWER_TOKENS = 1_200
PICTURE_TOKENS = 1_500
"""Guesses, for where nothing is known yet."""

SAMPLES = 3
"""So many of the scenarios have their prompts measured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContestantEstimate:
    """What one contestant is expected to use in a job.

    Attributes:
        rows: Augmentations.
        calls: At least, as expected, and at most; retries after faults come on top.
        tokens_in, tokens_out: As expected.
        usd: As expected, None where a price is unknown.
        usd_most: Where every answer is as long as it may be and every round is used.
        seen: So many earlier augmentations the expectation rests on; 0 for a guess.
        answered: So many of the rows have their answers in the store already.
    """

    slug: str
    name: str
    rows: int
    calls: tuple[int, int, int]
    tokens_in: int
    tokens_out: int
    usd: Decimal | None
    usd_most: Decimal | None
    seen: int
    answered: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class JobEstimate:
    """A job before it is launched: lines of those that ask language models, and all rows.

    Attributes:
        seconds: For the calls that are expected, with every endpoint as busy as it may be.
        is_time_guessed: Whether a model among them has never been asked yet.
    """

    rows: int
    scenarios: int
    contestants: int
    lines: tuple[ContestantEstimate, ...]
    seconds: float = 0.0
    is_time_guessed: bool = False

    @property
    def answered(self) -> int:
        """Augmentations whose answers are there already."""
        return sum(line.answered for line in self.lines)

    @property
    def asking_rows(self) -> int:
        """Augmentations that ask a language model."""
        return sum(line.rows for line in self.lines)

    @property
    def calls(self) -> tuple[int, int, int]:
        """At least, as expected, at most."""
        least, usual, most = (sum(line.calls[n] for line in self.lines) for n in range(3))
        return least, usual, most

    @property
    def tokens_in(self) -> int:
        """As expected."""
        return sum(line.tokens_in for line in self.lines)

    @property
    def tokens_out(self) -> int:
        """As expected."""
        return sum(line.tokens_out for line in self.lines)

    @property
    def unpriced(self) -> tuple[ContestantEstimate, ...]:
        """Lines whose cost nobody knows."""
        return tuple(line for line in self.lines if line.usd is None)

    @property
    def unpriced_names(self) -> str:
        """Whose they are, as a list in a sentence."""
        return ", ".join(line.name for line in self.unpriced)

    @property
    def usd(self) -> Decimal:
        """As expected, of the lines with prices."""
        return sum((line.usd for line in self.lines if line.usd is not None), Decimal(0))

    @property
    def usd_most(self) -> Decimal:
        """At most, of the lines with prices, rounded up to cents."""
        most = sum((line.usd_most for line in self.lines if line.usd_most is not None), Decimal(0))
        return most.quantize(Decimal("0.01"), rounding=ROUND_UP)

    @property
    def guessed(self) -> tuple[ContestantEstimate, ...]:
        """Lines that rest on no earlier augmentation."""
        return tuple(line for line in self.lines if not line.seen)

    def rows_within(self, usd: Decimal) -> int | None:
        """About so many of the asking rows fit into a cap; None where all are expected to."""
        if usd >= self.usd:
            return None
        return int(self.asking_rows * usd / self.usd)


def estimate(
    contestants: Sequence[str],
    scenarios: Sequence[str],
    *,
    samples: int = 1,
    is_fresh: bool = False,
) -> JobEstimate:
    """What a job of these would use; slugs that nobody knows are left out.

    Raises:
        UnknownName: A contestant's variant is none of ours any more.
        Conflict: An endpoint that a contestant names is gone.
    """
    who = Contestant.objects.filter(slug__in=contestants).select_related("endpoint")
    return estimate_rows(list(who.order_by("slug")), scenarios, samples=samples, is_fresh=is_fresh)


def estimate_rows(
    who: Sequence[Contestant],
    scenarios: Sequence[str],
    *,
    samples: int = 1,
    is_fresh: bool = False,
) -> JobEstimate:
    """The same of contestants, each once, be they stored or not."""
    where = Scenario.objects.filter(slug__in=scenarios).order_by("slug")
    count = where.count()
    asking = [row for row in who if row.endpoint is not None]
    measured = _spread(list(where.values_list("pk", flat=True))) if asking else []
    prompts = _Prompts(Scenario.objects.select_related("base_scene").filter(pk__in=measured))
    asked = count * samples
    answered: Counter[int] = Counter()
    if not is_fresh:
        answered = count_answered(asking, scenarios, samples=samples)
    lines = tuple(_line(row, asked, answered[row.pk], prompts) for row in asking if count)
    load = [
        (row, line.calls[1], latency_of(row)) for row, line in zip(asking, lines, strict=False)
    ]
    return JobEstimate(
        rows=len(who) * asked,
        scenarios=count,
        contestants=len(who),
        lines=lines,
        seconds=seconds_for(load),
        is_time_guessed=any(not latency.calls for _, calls, latency in load if calls),
    )


# --- Private -----------------------------------------------------------------------------------


def _spread(pks: list[int]) -> list[int]:
    step = max(1, len(pks) // SAMPLES)
    return pks[::step][:SAMPLES]


class _Prompts:
    """The first prompts of some scenarios, each measured once."""

    def __init__(self, samples: Iterable[Scenario]) -> None:
        self._samples = [
            (scene_of(row), row.instruction, reference_of(row) or Modification())
            for row in samples
        ]
        self._measured: dict[tuple[Recipe, ModelRole], tuple[int, int]] = {}

    def tokens(self, recipe: Recipe, role: ModelRole) -> tuple[int, int]:
        """About so many on average, and at most so many."""
        key = (recipe, role)
        if key not in self._measured:
            self._measured[key] = self._measure(recipe, role)
        return self._measured[key]

    def _measure(self, recipe: Recipe, role: ModelRole) -> tuple[int, int]:
        # Of the viewer's only one is drawn: a picture takes longer than all the rest.
        samples = self._samples[:1] if role is ModelRole.VIEWER else self._samples
        shown = [shown_prompt(recipe, role, *sample) for sample in samples]
        about = sum(one.tokens for one in shown) // len(shown)
        pictures = max(len(message.images) for one in shown for message in one.messages)
        most = max(
            worst_case(Request(model="", messages=one.messages)).prompt_tokens for one in shown
        )
        return about + PICTURE_TOKENS * pictures, most


def _line(row: Contestant, count: int, answered: int, prompts: _Prompts) -> ContestantEstimate:
    recipe = recipe_with(find_recipe(row.variant), options_of(row))
    respondents = respondents_of(row)
    calls = calls_of(recipe)
    prices = {role: _price(respondent) for role, respondent in respondents.items()}
    used, usual_calls, seen = _seen(row)
    if not seen:
        usual_calls = float(sum(one.usual for one in calls.values()))
        used = {
            role: TokenUse(
                prompt=one.usual * prompts.tokens(recipe, role)[0],
                completion=one.usual * ANSWER_TOKENS,
            )
            for role, one in calls.items()
        }
    most = most_tokens(recipe, {role: prompts.tokens(recipe, role)[1] for role in calls})
    left = count - answered
    return ContestantEstimate(
        slug=row.slug,
        name=row.name,
        rows=count,
        calls=(
            left * sum(one.least for one in calls.values()),
            round(left * usual_calls),
            count * sum(one.most for one in calls.values()),
        ),
        tokens_in=left * sum(use.prompt for use in used.values()),
        tokens_out=left * sum(use.completion for use in used.values()),
        usd=_usd(used, prices, left),
        usd_most=_usd(most, prices, count),
        seen=seen,
        answered=answered,
    )


def _price(respondent: Respondent) -> Price | None:
    return price_of(respondent.endpoint, respondent.model)


def _usd(
    used: dict[ModelRole, TokenUse], prices: dict[ModelRole, Price | None], count: int
) -> Decimal | None:
    total = 0
    for role, use in used.items():
        price = prices[role]
        if price is None:
            return None
        total += count * price.nano_usd(prompt_tokens=use.prompt, completion_tokens=use.completion)
    return usd_of(total)


def _seen(row: Contestant) -> tuple[dict[ModelRole, TokenUse], float, int]:
    """By role what one augmentation used on average, its calls, and over how many that is.

    Of one that is not stored yet: from all that ask the same model in the same variant.

    Counted are augmentations that came to an end and asked for everything they needed; those that
    were answered from the store would make the next ones look too cheap.
    """
    alike = (
        Q(contestant=row)
        if row.pk
        else Q(
            contestant__endpoint=row.endpoint,
            contestant__model=row.model,
            contestant__variant=row.variant,
            contestant__roles=row.roles,
        )
    )
    ended = Augmentation.objects.filter(alike).exclude(
        state__in=(
            *Augmentation.UNDER_WAY,
            Augmentation.State.FAILED,
            Augmentation.State.CANCELLED,
        )
    )
    fresh = ended.filter(attempts__calls__isnull=False).exclude(
        attempts__calls__served_from__isnull=False
    )
    pks = set(fresh.values_list("pk", flat=True))
    calls = ModelCall.objects.filter(
        attempt__augmentation__in=pks, prompt_tokens__isnull=False, completion_tokens__isnull=False
    )
    used: dict[ModelRole, TokenUse] = {}
    made = 0
    for group in (
        calls.order_by("role")
        .values("role")
        .annotate(
            made=Count("pk"), prompt=Sum("prompt_tokens"), completion=Sum("completion_tokens")
        )
    ):
        made += group["made"]
        used[ModelRole(group["role"])] = TokenUse(
            prompt=group["prompt"] // len(pks), completion=group["completion"] // len(pks)
        )
    return (used, made / len(pks), len(pks)) if used else ({}, 0.0, 0)
