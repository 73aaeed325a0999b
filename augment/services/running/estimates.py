"""What a job may cost, before it is launched: from what its contestants used, else a guess."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_UP, Decimal
from functools import cache

from django.db.models import Count, Exists, OuterRef, Q, Sum

from augment.llm.costs import usd_of, worst_case
from augment.llm.messages import Request
from augment.models import Augmentation, Contestant, ModelCall, Scenario
from augment.prompts.fill import prompt_version
from augment.scene.entities import Modification
from augment.services.endpoints.known_models import price_of
from augment.services.endpoints.treatments import Respondent, options_of, respondents_of
from augment.services.running.jobs import JobScope
from augment.services.scenarios.scenes import reference_of, scene_of
from augment.variants.options import recipe_with
from augment.variants.recipes import Recipe, find_recipe
from augment.variants.respondents import ModelRole
from augment.variants.showing import TokenUse, calls_of, most_tokens, shown_prompt

ANSWER_TOKENS = 1_200
PICTURE_TOKENS = 1_500
"""Guesses, for where nothing is known yet."""

SAMPLES = 3
"""So many of the scenarios have their prompts measured."""

State = Augmentation.State


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
    """A job before it is launched: a line for each contestant that asks models, and all rows.

    Attributes:
        asking_rows: Augmentations that ask a language model.
        answered: Augmentations whose answers are there already.
        calls: At least, as expected, at most.
        tokens_in, tokens_out: As expected.
        usd, usd_most: As expected, and at most rounded up to cents, of the lines with prices.
    """

    rows: int
    scenarios: int
    contestants: int
    lines: tuple[ContestantEstimate, ...]
    asking_rows: int
    answered: int
    calls: tuple[int, ...]
    tokens_in: int
    tokens_out: int
    usd: Decimal
    usd_most: Decimal

    @property
    def unpriced(self) -> tuple[ContestantEstimate, ...]:
        """Lines whose cost nobody knows."""
        return tuple(line for line in self.lines if line.usd is None)

    @property
    def unpriced_names(self) -> str:
        """Whose they are, as a list in a sentence."""
        return ", ".join(line.name for line in self.unpriced)

    @property
    def guessed(self) -> tuple[ContestantEstimate, ...]:
        """Lines that rest on no earlier augmentation."""
        return tuple(line for line in self.lines if not line.seen)

    def rows_within(self, usd: Decimal) -> int | None:
        """Return about how many asking rows fit into a cap; None where all are expected to."""
        return None if usd >= self.usd else int(self.asking_rows * usd / self.usd)


def estimate(scope: JobScope, who: Sequence[Contestant] | None = None) -> JobEstimate:
    """Return what a job of these would use; unknown slugs are left out.

    Args:
        scope: What the job runs.
        who: Its contestants, each once, where some are not stored yet.

    Raises:
        UnknownName: A contestant's variant is none of ours any more.
        Conflict: An endpoint that a contestant names is gone.
    """
    if who is None:
        rows = Contestant.objects.filter(slug__in=scope.contestants)
        who = list(rows.select_related("endpoint").order_by("slug"))
    where = Scenario.objects.filter(slug__in=scope.scenarios).order_by("slug")
    pks = list(where.values_list("pk", flat=True))
    asking = [row for row in who if row.endpoint is not None and pks]
    measured = pks[:: max(1, len(pks) // SAMPLES)][:SAMPLES] if asking else []
    prompts = _Prompts(Scenario.objects.select_related("base_scene").filter(pk__in=measured))
    cells = len(pks) * scope.samples
    answered = Counter[int]() if scope.is_fresh else _count_answered(asking, scope)
    lines = tuple(_line(row, cells, answered[row.pk], prompts) for row in asking)
    usd_most = sum((line.usd_most or Decimal(0) for line in lines), Decimal(0))
    return JobEstimate(
        rows=len(who) * cells,
        scenarios=len(pks),
        contestants=len(who),
        lines=lines,
        asking_rows=len(asking) * cells,
        answered=answered.total(),
        calls=tuple(sum(line.calls[place] for line in lines) for place in range(3)),
        tokens_in=sum(line.tokens_in for line in lines),
        tokens_out=sum(line.tokens_out for line in lines),
        usd=sum((line.usd or Decimal(0) for line in lines), Decimal(0)),
        usd_most=usd_most.quantize(Decimal("0.01"), rounding=ROUND_UP),
    )


# --- Private -----------------------------------------------------------------------------------


class _Prompts:
    """The first prompts of some scenarios, each measured once."""

    def __init__(self, scenarios: Iterable[Scenario]) -> None:
        self._samples = [
            (scene_of(row), row.instruction, reference_of(row) or Modification())
            for row in scenarios
        ]
        self.tokens = cache(self._tokens)

    def _tokens(self, recipe: Recipe, role: ModelRole) -> tuple[int, int]:
        """Return about how many tokens on average, and at most how many."""
        # Of the viewer's only one is drawn: a picture takes longer than all the rest.
        samples = self._samples[:1] if role is ModelRole.VIEWER else self._samples
        shown = [shown_prompt(recipe, role, *sample) for sample in samples]
        pictures = max(len(message.images) for prompt in shown for message in prompt.messages)
        requests = [Request(model="", messages=prompt.messages) for prompt in shown]
        about = sum(prompt.tokens for prompt in shown) // len(shown) + PICTURE_TOKENS * pictures
        return about, max(worst_case(request).prompt_tokens for request in requests)


def _line(row: Contestant, rows: int, answered: int, prompts: _Prompts) -> ContestantEstimate:
    recipe = recipe_with(find_recipe(row.variant), options_of(row))
    respondents = respondents_of(row)
    calls = calls_of(recipe)
    used, usual_calls, seen = _used_before(row)
    if not seen:
        usual_calls = float(sum(one.usual for one in calls.values()))
        for role, one in calls.items():
            prompt = one.usual * prompts.tokens(recipe, role)[0]
            used[role] = TokenUse(prompt=prompt, completion=one.usual * ANSWER_TOKENS)
    most = most_tokens(recipe, {role: prompts.tokens(recipe, role)[1] for role in calls})
    left = rows - answered
    return ContestantEstimate(
        slug=row.slug,
        name=row.name,
        rows=rows,
        calls=(
            left * sum(one.least for one in calls.values()),
            round(left * usual_calls),
            rows * sum(one.most for one in calls.values()),
        ),
        tokens_in=left * sum(use.prompt for use in used.values()),
        tokens_out=left * sum(use.completion for use in used.values()),
        usd=_usd(used, respondents, left),
        usd_most=_usd(most, respondents, rows),
        seen=seen,
        answered=answered,
    )


def _usd(
    used: Mapping[ModelRole, TokenUse], respondents: Mapping[ModelRole, Respondent], rows: int
) -> Decimal | None:
    total = 0
    for role, use in used.items():
        price = price_of(respondents[role].endpoint, respondents[role].model)
        if price is None:
            return None
        total += rows * price.nano_usd(prompt_tokens=use.prompt, completion_tokens=use.completion)
    return usd_of(total)


def _count_answered(contestants: Sequence[Contestant], scope: JobScope) -> Counter[int]:
    """Count by contestant the cells that it has answered before with the installed prompts.

    Their requests are the same, so their answers come from the store and cost nothing.
    """
    asked = ModelCall.objects.filter(
        attempt__augmentation=OuterRef("pk"), answer__isnull=False, prompt_version=prompt_version()
    )
    cells = Augmentation.objects.order_by().filter(
        Exists(asked),
        contestant__in=[row.pk for row in contestants if row.pk is not None],
        scenario__slug__in=scope.scenarios,
        sample__lte=scope.samples,
        state__in=Augmentation.SHOWABLE,
    )
    return Counter(
        contestant
        for contestant, _, _ in cells.values_list(
            "contestant_id", "scenario_id", "sample"
        ).distinct()
    )


def _used_before(row: Contestant) -> tuple[dict[ModelRole, TokenUse], float, int]:
    """Return by role what one augmentation used on average, its calls, and over how many.

    Of a contestant that is not stored yet: from all that ask the same model in the same variant.
    Counted are augmentations that came to an end and asked for everything they needed; those that
    were answered from the store would make the next ones look too cheap.
    """
    asked_alike = {
        f"contestant__{name}": getattr(row, name)
        for name in ("endpoint", "model", "variant", "roles")
    }
    alike = Q(contestant=row) if row.pk else Q(**asked_alike)
    unfinished = (*Augmentation.UNDER_WAY, State.FAILED, State.CANCELLED)
    ended = Augmentation.objects.filter(alike).exclude(state__in=unfinished)
    fresh = ended.filter(attempts__calls__isnull=False).exclude(
        attempts__calls__served_from__isnull=False
    )
    pks = set(fresh.values_list("pk", flat=True))
    calls = ModelCall.objects.filter(
        attempt__augmentation__in=pks, prompt_tokens__isnull=False, completion_tokens__isnull=False
    )
    groups = calls.order_by("role").values_list("role")
    used: dict[ModelRole, TokenUse] = {}
    made = 0
    for role, number, prompt, completion in groups.annotate(
        Count("pk"), Sum("prompt_tokens"), Sum("completion_tokens")
    ):
        made += number
        used[ModelRole(role)] = TokenUse(
            prompt=prompt // len(pks), completion=completion // len(pks)
        )
    return (used, made / len(pks), len(pks)) if used else ({}, 0.0, 0)
