"""What of a new job is answered already, and how long the rest may take."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from django.db.models import Avg, Count, Exists, OuterRef, Q

from augment.models import Augmentation, Contestant, Endpoint, ModelCall
from augment.prompts.texts import prompt_version
from augment.services.running.estimates import Spell, spells_at_address

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
