"""Run inside the product's settings: makes an enrolment link, drops the silent, counts; as JSON.

python -m bench.enrolment_rows link PLACES QUOTA | drop | count
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable
from datetime import timedelta
from typing import Any

import django

django.setup()

from django.db.models import Count  # noqa: E402
from django.utils import timezone  # noqa: E402

from arena.models import EnrolledVoter, Enrolment, Study, Vote  # noqa: E402
from arena.queries.enrolments import enrolled_voters, state_of  # noqa: E402
from arena.services.enrolments import drop_silent, set_enrolment  # noqa: E402


def link(places: int, quota: int) -> dict[str, Any]:
    enrolment = set_enrolment(
        study=Study.objects.get(),
        consent="I take part of my own free will.",
        asks_for="Your worker ID",
        places=places,
        votes_each=quota,
        drop_out_after_h=24,
    )
    return {"token": enrolment.token}


def drop() -> dict[str, Any]:
    """As if a day and an hour had gone by."""
    later = timezone.now() + timedelta(hours=25)
    return {"dropped": drop_silent(enrolment=Enrolment.objects.get(), now=later)}


def count() -> dict[str, Any]:
    """All that must hold, in numbers."""
    study, enrolment = Study.objects.get(), Enrolment.objects.get()
    voters = list(enrolled_voters(enrolment))
    kept = [voter for voter in voters if voter.dropped_at is None]
    state = state_of(enrolment)
    main = study.matchups.filter(kind="main")
    pairs: Counter[tuple[int, ...]] = Counter()
    for left, right, number in (
        main.order_by().values_list("left__contestant", "right__contestant").annotate(Count("pk"))
    ):
        pairs[tuple(sorted((left, right)))] += number
    scenarios = Counter(dict(main.order_by().values_list("scenario").annotate(Count("pk"))))
    votes = Vote.objects.filter(matchup__study=study)
    by_matchup = votes.order_by().values("matchup").annotate(n=Count("pk")).filter(n__gt=1)
    seen_twice = main.order_by().values("expert", "scenario").annotate(n=Count("pk"))
    return {
        "voters": len(voters),
        "ids": len({voter.external_id for voter in voters}),
        "accounts": len({voter.expert_id for voter in voters}),
        "places": state.places,
        "taken": state.taken,
        "done": state.done,
        "dropped": state.dropped,
        "codes": len(set(EnrolledVoter.objects.values_list("completion_code", flat=True))),
        "off_quota": sum(voter.planned != enrolment.votes_each for voter in kept),
        "votes": votes.count(),
        "matchups_with_two_votes": by_matchup.count(),
        "pairs": [min(pairs.values()), max(pairs.values())],
        "scenarios": [min(scenarios.values()), max(scenarios.values())],
        "scenario_most_in_one_quota": max(row["n"] for row in seen_twice),
        "codes_by_id": {voter.external_id: voter.completion_code for voter in kept},
    }


if __name__ == "__main__":
    name, *numbers = sys.argv[1:]
    steps: dict[str, Callable[..., object]] = {"link": link, "drop": drop, "count": count}
    print(json.dumps(steps[name](*map(int, numbers))))
