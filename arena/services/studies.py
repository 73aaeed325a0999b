"""Opening and closing a study. Its plan is stored before anybody can vote."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import F
from django.utils import timezone

from arena.errors import NothingToPlan, StudyNotOpen
from arena.models import Matchup, Study
from arena.pairing.plan import Entry, Plan, Rules, plan
from arena.queries.people import experts as expert_accounts
from augment.errors import Conflict, UnknownName
from augment.models import Augmentation, Contestant, Scenario
from augment.services.events import log_event
from augment.services.texts import one_line

PLANNER = "balanced-1"
"""Name and version of the planner, kept with the rules so that a plan can be made again."""

Cells = dict[tuple[str, str], Augmentation]


@transaction.atomic
def open_study(
    *,
    name: str,
    contestants: Sequence[str],
    scenarios: Sequence[str],
    experts: Sequence[str],
    votes_per_expert: int,
    seed: int,
    allow_simulated: bool = False,
    actor: User | None = None,
) -> Study:
    """Plan all matchups of a new study and open it.

    Args:
        name: Of the study, unique.
        contestants: Slugs; each one's latest picture of each scenario takes part.
        scenarios: Slugs.
        experts: Usernames of accounts with the role expert.
        votes_per_expert: How many matchups each expert judges.
        seed: Of the plan; the same seed and rules give the same plan.
        allow_simulated: Let simulated contestants and experts take part; everything then says so.
        actor: Who opens it, for the log.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: A contestant, scenario or expert does not exist.
        Conflict: The name is taken, the seed is out of range, or something simulated takes part
            unasked.
        NothingToPlan: Pictures are missing, or too few to fill the votes; the text has numbers.
    """
    name = _free_name(name)
    _check_seed(seed)
    contestant_rows = _contestants(contestants)
    scenario_rows = _scenarios(scenarios)
    expert_rows = _experts(experts)
    if not allow_simulated:
        _refuse_simulated(contestant_rows, expert_rows)
    cells = _latest_pictures(contestant_rows, scenario_rows)
    rules = _rules(cells, expert_rows, votes_per_expert, seed)
    planned = plan(rules)
    study = _insert(name, rules, planned, allow_simulated)
    study.contestants.set(contestant_rows)
    study.scenarios.set(scenario_rows)
    study.experts.set(expert_rows)
    _store(study, planned, cells, expert_rows)
    log_event(
        actor=actor,
        verb="open",
        object_kind="study",
        object_code=study.code,
        after={"name": name, "matchups": len(planned.matchups), "seed": seed},
    )
    return study


@transaction.atomic
def close_study(*, study: Study, actor: User | None = None) -> Study:
    """Take no more votes; closing a closed study changes nothing.

    Votes under way are waited for, so none arrives after the study is closed.

    Raises:
        StudyNotOpen: The study is a draft.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == Study.State.CLOSED:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study {study.name!r} is a draft: there is nothing to close.")
    # A vote holds its matchup's row until it is stored; see arena.services.votes.
    list(study.matchups.select_for_update().order_by("pk").values_list("pk", flat=True))
    study.state = Study.State.CLOSED
    study.closed_at = timezone.now()
    study.save(update_fields=["state", "closed_at"])
    log_event(
        actor=actor,
        verb="close",
        object_kind="study",
        object_code=study.code,
        before={"state": "open"},
        after={"state": "closed"},
    )
    return study


def rules_of(study: Study) -> Rules:
    """The rules as they were at opening; planning them again gives the study's matchups."""
    kept = study.rules
    return Rules(
        entries=tuple(Entry(**entry) for entry in kept["entries"]),
        experts=tuple(kept["experts"]),
        votes_per_expert=kept["votes_per_expert"],
        seed=kept["seed"],
        scenario_gap=kept["scenario_gap"],
    )


# --- Who and what takes part -------------------------------------------------------------------


def _free_name(name: str) -> str:
    name = one_line("name", name, what="study")
    if Study.objects.filter(name=name).exists():
        raise _taken(name)
    return name


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")


def _contestants(slugs: Sequence[str]) -> list[Contestant]:
    known = {row.slug: row for row in Contestant.objects.select_related("endpoint")}
    return [_named("contestant", slug, known) for slug in sorted(set(slugs))]


def _scenarios(slugs: Sequence[str]) -> list[Scenario]:
    known = {row.slug: row for row in Scenario.objects.only("slug")}
    return [_named("scenario", slug, known) for slug in sorted(set(slugs))]


def _experts(usernames: Sequence[str]) -> list[User]:
    known = {user.username: user for user in expert_accounts()}
    return [_named("expert", username, known) for username in sorted(set(usernames))]


def _named(kind: str, name: str, known: dict[str, Any]) -> Any:
    if name not in known:
        raise UnknownName(kind, name, sorted(known))
    return known[name]


def _refuse_simulated(contestants: list[Contestant], experts: list[User]) -> None:
    simulated = [f"contestant {row.slug}" for row in contestants if row.is_simulated]
    simulated += [f"expert {user.username}" for user in experts if user.person.is_simulated]
    if simulated:
        raise Conflict(
            f"Simulated: {', '.join(simulated)}. They never mix into a rating unless the study "
            "allows simulated contestants and votes."
        )


def _latest_pictures(contestants: list[Contestant], scenarios: list[Scenario]) -> Cells:
    """The augmentation that finished last, per scenario and contestant; all must exist."""
    found = (
        Augmentation.objects.filter(
            contestant__in=contestants, scenario__in=scenarios, state__in=Augmentation.SHOWABLE
        )
        .exclude(image="")
        .select_related("scenario", "contestant")
        .only("image", "scenario__slug", "contestant__slug")
        .order_by(F("finished_at").asc(nulls_first=True), "pk")
    )
    cells = {(row.scenario.slug, row.contestant.slug): row for row in found}
    missing = [
        f"{contestant.slug} on {scenario.slug}"
        for contestant in contestants
        for scenario in scenarios
        if (scenario.slug, contestant.slug) not in cells
    ]
    if missing:
        more = f" and {len(missing) - 8} more" if len(missing) > 8 else ""
        raise NothingToPlan(
            f"There is no picture yet of {', '.join(missing[:8])}{more}. Generate them first."
        )
    return cells


def _rules(cells: Cells, experts: list[User], votes_per_expert: int, seed: int) -> Rules:
    return Rules(
        entries=tuple(
            Entry(scenario=scenario, contestant=contestant, picture=cell.image)
            for (scenario, contestant), cell in sorted(cells.items())
        ),
        experts=tuple(expert.username for expert in experts),
        votes_per_expert=votes_per_expert,
        seed=seed,
    )


# --- What is kept ------------------------------------------------------------------------------


def _insert(name: str, rules: Rules, planned: Plan, allow_simulated: bool) -> Study:
    try:
        with transaction.atomic():
            return Study.objects.create(
                name=name,
                state=Study.State.OPEN,
                votes_per_expert=rules.votes_per_expert,
                seed=rules.seed,
                rules=_frozen_rules(rules, planned),
                allow_simulated=allow_simulated,
                opened_at=timezone.now(),
            )
    except IntegrityError:  # somebody else was faster
        raise _taken(name) from None


def _taken(name: str) -> Conflict:
    return Conflict(f"There is a study named {name!r} already.")


def _frozen_rules(rules: Rules, planned: Plan) -> dict[str, Any]:
    """Everything that the plan came from, and what it had to give up."""
    kept: dict[str, Any] = {"planner": PLANNER, **asdict(rules)}
    kept["scenario_gap_kept"] = planned.scenario_gap
    kept["identical"] = [list(triple) for triple in planned.identical]
    return kept


def _store(study: Study, planned: Plan, cells: Cells, experts: list[User]) -> None:
    by_name = {expert.username: expert for expert in experts}
    rows = []
    for one in planned.matchups:
        left = cells[one.scenario, one.left]
        right = cells[one.scenario, one.right]
        rows.append(
            Matchup(
                study=study,
                expert=by_name[one.expert],
                position=one.position,
                scenario_id=left.scenario_id,
                left=left,
                right=right,
                draw_probability=one.draw_probability,
            )
        )
    Matchup.objects.bulk_create(rows, batch_size=500)
