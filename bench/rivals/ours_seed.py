"""Run inside the product's settings: a study to vote in, printed as JSON with one link a voter."""

from __future__ import annotations

import json
import sys

import django

django.setup()

from arena.people.links import invite  # noqa: E402
from arena.people.services import create_person  # noqa: E402
from augment.models import Augmentation, Contestant, GenerationJob, Scenario  # noqa: E402
from augment.services.scenarios.catalogue import load_catalogue  # noqa: E402
from augment.services.scenarios.pictures import store  # noqa: E402
from bench.rivals.environments import ROOT  # noqa: E402
from tests.opening import open_study  # noqa: E402
from tests.web.cast import png  # noqa: E402

CONTESTANTS = ("ann", "bob", "cid", "dora")


def main(voters: int, votes_each: int) -> None:
    load_catalogue(folder=ROOT / "fixtures")
    job = GenerationJob.objects.create(name="bench")
    scenarios = list(Scenario.objects.order_by("slug"))
    shade = 0
    for slug in CONTESTANTS:
        row = Contestant.objects.create(slug=slug, name=slug, kind=Contestant.Kind.RULE)
        for scenario in scenarios:
            shade += 1
            Augmentation.objects.create(
                job=job,
                scenario=scenario,
                contestant=row,
                state=Augmentation.State.DONE,
                modification={},
                image=store(png(shade % 256) + shade.to_bytes(4, "big")),
            )
    experts = [
        create_person(username=f"voter-{number:02}", password=None, role="expert")
        for number in range(voters)
    ]
    study = open_study(
        name="Bench",
        contestants=list(CONTESTANTS),
        scenarios=[scenario.slug for scenario in scenarios],
        experts=[expert.username for expert in experts],
        votes_per_expert=votes_each,
        seed=1,
    )
    tokens = [invite(study=study, expert=expert).token for expert in experts]
    print(json.dumps({"study": str(study.code), "tokens": tokens}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
