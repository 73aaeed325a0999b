"""Expected cost of a job, from its contestants' use so far."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

from django.db.models import Count, Q, Sum

from augment.llm.costs import to_usd
from augment.models import Augmentation, Contestant, ModelCall, Scenario
from augment.services.endpoints.contestants import read_options, read_respondents
from augment.services.running.jobs import JobScope, with_followed
from augment.variants.options import recipe_with
from augment.variants.recipes import find_recipe
from augment.variants.respondents import ModelRole
from augment.variants.showing import count_calls

State = Augmentation.State


@dataclass(frozen=True, slots=True, kw_only=True)
class ContestantEstimate:
    """Expected use of one contestant in a job.

    Attributes:
        rows: Augmentations.
        calls: At least, as expected, and at most; retries after faults come on top.
        tokens_in, tokens_out: None for a contestant that has run nothing yet.
        usd: None as well where a price is unknown.
        seen: So many earlier augmentations the expectation rests on.
    """

    slug: str
    name: str
    rows: int
    calls: tuple[int, int, int]
    tokens_in: int | None = None
    tokens_out: int | None = None
    usd: Decimal | None = None
    seen: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class JobEstimate:
    """A job before it is launched: a line for each contestant that asks models, and all rows.

    Attributes:
        asking_rows: Augmentations that ask a language model.
    """

    rows: int
    scenarios: int
    contestants: int
    lines: tuple[ContestantEstimate, ...]
    asking_rows: int

    @property
    def calls(self) -> tuple[int, ...]:
        """At least, as expected, at most."""
        return tuple(sum(line.calls[place] for line in self.lines) for place in range(3))

    @property
    def tokens_in(self) -> int | None:
        """Tokens of the prompts, as far as known; None if none are."""
        return None if (known := self._sum("tokens_in")) is None else int(known)

    @property
    def tokens_out(self) -> int | None:
        """Tokens of the answers, as far as known; None if none are."""
        return None if (known := self._sum("tokens_out")) is None else int(known)

    @property
    def usd(self) -> Decimal | None:
        """The cost, likewise."""
        return self._sum("usd")

    def _sum(self, name: str) -> Decimal | None:
        known = [value for line in self.lines if (value := getattr(line, name)) is not None]
        return sum(known, Decimal(0)) if known or not self.lines else None

    @property
    def unpriced(self) -> tuple[ContestantEstimate, ...]:
        """Lines whose cost nobody knows."""
        return tuple(line for line in self.lines if line.usd is None)


def estimate(scope: JobScope, who: Sequence[Contestant] | None = None) -> JobEstimate:
    """Return the estimate of a job; unknown slugs are left out.

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
    scenarios = len(with_followed(Scenario.objects.filter(slug__in=scope.scenarios)))
    cells = scenarios * scope.samples
    asking = [row for row in who if row.endpoint is not None and cells]
    return JobEstimate(
        rows=len(who) * cells,
        scenarios=scenarios,
        contestants=len(who),
        lines=tuple(_line(row, cells) for row in asking),
        asking_rows=len(asking) * cells,
    )


# --- Private -----------------------------------------------------------------------------------


def _line(row: Contestant, cells: int) -> ContestantEstimate:
    calls = count_calls(recipe_with(find_recipe(row.variant), read_options(row)))
    least, usual, most = (cells * number for number in calls)
    line = ContestantEstimate(slug=row.slug, name=row.name, rows=cells, calls=(least, usual, most))
    seen, used = _average_use(row)
    if not used:
        return line
    numbers, prompts, completions = (
        round(cells / seen * sum(counts)) for counts in zip(*used.values(), strict=True)
    )
    return replace(
        line,
        calls=(least, numbers, most),
        tokens_in=prompts,
        tokens_out=completions,
        usd=_usd(row, used, cells / seen),
        seen=seen,
    )


def _usd(
    row: Contestant, used: Mapping[ModelRole, tuple[int, int, int]], share: float
) -> Decimal | None:
    respondents, total = read_respondents(row), 0
    for role, (_, prompt, completion) in used.items():
        price = respondents[role].price
        if price is None:
            return None
        total += price.nano_usd(prompt_tokens=prompt, completion_tokens=completion)
    return to_usd(round(share * total))


def _average_use(row: Contestant) -> tuple[int, dict[ModelRole, tuple[int, int, int]]]:
    """Return over how many augmentations, and by role its calls, prompt and completion tokens.

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
    used = groups.annotate(Count("pk"), Sum("prompt_tokens"), Sum("completion_tokens"))
    return len(pks), {ModelRole(role): (number, *tokens) for role, number, *tokens in used}
