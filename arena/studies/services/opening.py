"""The file in which a study says what it will do, frozen before its first vote.

It names nobody: experts are numbers, in the order of their names, so that forgetting somebody
later leaves no trace here. Its SHA-256 stands in every export of the study.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import StudyNotOpen
from arena.models import Study
from arena.pairing.plan import Check, Entry, MatchupPlan, PlanRules, plan
from arena.pairing.rules import (
    ATTENTION_CHECKS,
    MOST_CHECKS,
    Triple,
    check_share,
    draw_shown,
    read_targets,
)
from arena.people.queries import experts as expert_accounts
from arena.rating.snapshot_document import VERSION as RESULTS_VERSION
from arena.services.frames import Cells
from arena.services.replays import Replays, replays_of
from arena.services.shown_pictures import SampleRule, StudyPictures, choose_pictures
from arena.services.vote_rows import VERSION as VOTES_VERSION
from arena.studies.services.experts import require_practice_pictures
from arena.studies.services.pictures import enough_checks, placed_checks, windows_of
from arena.studies.services.plan import SWITCH_COLUMNS, StudyPlan, read_hypotheses
from arena.studies.services.planning import rules_of, store
from augment.errors import Conflict, UnknownName
from augment.models import Contestant, Scenario
from augment.services.endpoints.treatments import options_of
from augment.services.events import log_event
from augment.services.judging.displacement import alike_pairs
from augment.services.running.choosing import find_job
from augment.services.texts import check_prose, one_line

FORMAT, VERSION = "scenario-arena/preregistration", 1
FILE_NAME = "preregistration.json"
_ELSEWHERE = frozenset({"entries", "experts", "hypotheses", "stopping", "jobs", "options"})
"""Rules that have a place of their own in the file, or name people."""


def preregister(study: Study) -> None:
    """Freeze the file of a study that was just planned; in the transaction of its opening."""
    study.preregistration = _text(_document(study))
    study.save(update_fields=["preregistration"])


def preregistration_bytes(study: Study) -> bytes:
    """The file, empty for studies that were opened before there was one, or from a file."""
    return study.preregistration.encode()


def preregistration_sha256(study: Study) -> str:
    """The hash of the file, empty where there is none."""
    content = preregistration_bytes(study)
    return hashlib.sha256(content).hexdigest() if content else ""


def product_version() -> str:
    """Of this installation."""
    with (settings.BASE_DIR / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["version"])


# --- Private -----------------------------------------------------------------------------------


def _document(study: Study) -> dict[str, Any]:
    rules = study.rules
    contestants = study.contestants.select_related("endpoint").order_by("slug")
    return {
        "format": FORMAT,
        "version": VERSION,
        "product": {
            "name": "scenario-arena",
            "version": product_version(),
            "planner": rules["planner"],
            "results": RESULTS_VERSION,
            "votes": VOTES_VERSION,
        },
        "study": {"name": study.name, "code": str(study.code)},
        "opened_at": study.opened_at.isoformat() if study.opened_at else None,
        "seed": study.seed,
        "experts": len(rules["experts"]),
        "votes_planned": len(rules["experts"]) * study.votes_per_expert,
        "rules": {name: kept for name, kept in rules.items() if name not in _ELSEWHERE},
        "choices": {name.removeprefix("allow_"): getattr(study, name) for name in SWITCH_COLUMNS},
        "contestants": [_contestant(one) for one in contestants],
        "scenarios": [_scenario(one) for one in study.scenarios.order_by("slug")],
        "jobs": rules["jobs"],
        "pictures": rules["entries"],
        "plan": _plan(study),
        "hypotheses": rules["hypotheses"],
        "analysis": {
            "method": "Bradley-Terry on the Elo scale, ties half a win, mean 1000",
            "intervals": "95 %, two-way over experts and scenarios, closed form",
            "pairs": "all judged at once, 5 % for the whole table",
            "settled_pairs": "ties, as many a pair as others have votes on average",
            "left_out": "hidden repeats, attention checks, skips, superseded votes",
        },
    }


def _contestant(one: Contestant) -> dict[str, Any]:
    return {
        "slug": one.slug,
        "name": one.name,
        "kind": one.kind,
        "variant": one.variant,
        "model": one.model,
        "roles": one.roles,
        "options": options_of(one).to_document() if one.endpoint else None,
    }


def _scenario(one: Scenario) -> dict[str, Any]:
    return {"slug": one.slug, "type": one.type, "instruction": one.instruction}


def _plan(study: Study) -> dict[str, Any]:
    """The planned showings as one hash: expert's number, place, kind, scenario, left, right."""
    numbers = {name: number for number, name in enumerate(sorted(study.rules["experts"]), 1)}
    rows = study.matchups.values_list(
        *("expert__username", "position", "kind", "scenario__slug"),
        *("left__contestant__slug", "left__sample"),
        *("right__contestant__slug", "right__sample"),
    )
    lines = sorted((numbers[name], *rest) for name, *rest in rows)
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    return {
        "matchups": len(lines),
        "planned_later": sum(study.votes_to_plan.values()),
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
    }


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


LONGEST_WHY = 1_000


@transaction.atomic
def close_study(*, study: Study, actor: User | None = None) -> Study:
    """Take no more votes; its results may be read from now on. Closing twice changes nothing.

    Votes under way are waited for, so none arrives after the study is closed.

    Raises:
        StudyNotOpen: The study was cancelled.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == Study.State.CLOSED:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study '{study.name}' was cancelled: there is nothing to close.")
    return _end(study, Study.State.CLOSED, verb="close", actor=actor)


@transaction.atomic
def cancel_study(*, study: Study, why: str = "", actor: User | None = None) -> Study:
    """Give a study up: no more votes, no rating, no results. Cancelling twice changes nothing.

    The votes stay, as votes. Nobody reads ratings that were made early.

    Args:
        study: An open one.
        why: For the log, empty for no reason given.
        actor: Who does it, for the log.

    Raises:
        StudyNotOpen: The study is closed, and has results.
        InvalidDocument: The reason is too long, or can't be stored.
    """
    if why := why.strip():
        check_prose("why", why, what="study", longest=LONGEST_WHY)
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == Study.State.CANCELLED:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(
            f"The study '{study.name}' is closed: it has results and can't be cancelled."
        )
    more = {"why": why} if why else {}
    return _end(study, Study.State.CANCELLED, verb="cancel", actor=actor, **more)


def _end(study: Study, state: Study.State, *, verb: str, actor: User | None, **more: Any) -> Study:
    # A vote holds its matchup's row until it is stored; see arena.services.votes.
    list(study.matchups.select_for_update().order_by("pk").values_list("pk", flat=True))
    study.state = state
    study.closed_at = timezone.now()
    study.save(update_fields=["state", "closed_at"])
    log_event(
        actor=actor,
        verb=verb,
        object_kind="study",
        object_code=study.code,
        before={"state": Study.State.OPEN.value},
        after={"state": state.value, **more},
    )
    return study


__all__ = ["cancel_study", "close_study", "open_study", "rules_of"]

PLANNER = "balanced-2"
"""Name and version of the planner, kept with the rules so that a plan can be made again."""


@transaction.atomic
def open_study(study_plan: StudyPlan, *, actor: User | None = None) -> Study:
    """Plan all matchups of a new study and open it.

    Args:
        study_plan: Who takes part, and by which rules; the same ones give the same plan.
        actor: Who opens it, for the log.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: A contestant, scenario or expert does not exist.
        Conflict: The name is taken, the seed out of range, or something simulated unasked.
        NothingToPlan: A target or hypothesis can't be read; pictures, drives or checks are
            missing.
    """
    name = _free_name(study_plan.name)
    check_seed(study_plan.seed)
    contestant_rows = _contestants(study_plan.contestants)
    scenario_rows = _scenarios(study_plan.scenarios)
    expert_rows = _experts(study_plan.experts)
    has_simulated = _has_simulated(
        contestant_rows, expert_rows, are_allowed=study_plan.allow_simulated
    )
    jobs = [find_job(job) for job in study_plan.jobs]
    shown = choose_pictures(
        contestant_rows, scenario_rows, seed=study_plan.seed, rule=study_plan.samples, jobs=jobs
    )
    entries = _entries(shown.cells)
    checks, broken = _checks_for(study_plan, scenario_rows, entries)
    settled, kept = _alike(study_plan, shown.cells, entries)
    rules = replace(_rules(study_plan, entries, expert_rows), checks=checks, alike=settled)
    planned = plan(rules)
    played = replays_of(broken | shown.cells) if study_plan.allow_replay else None
    kept |= _frozen_rules(rules, planned, played) | _frozen_pictures(study_plan, shown)
    study = _insert(name, kept, study_plan, rules, has_simulated)
    _enrol(study, contestant_rows, scenario_rows, expert_rows)
    store(study, planned.matchups, broken | shown.cells, expert_rows)
    _conclude_opening(study, matchups=len(planned.matchups), actor=actor)
    return study


# --- Who and what takes part -------------------------------------------------------------------


def _free_name(name: str) -> str:
    name = one_line("name", name, what="study")
    if Study.objects.filter(name=name).exists():
        raise _taken(name)
    return name


def check_seed(seed: int) -> None:
    """Refuse what is no seed of a plan."""
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")


def _contestants(slugs: Sequence[str]) -> list[Contestant]:
    rateable = Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
    known = {row.slug: row for row in rateable.select_related("endpoint")}
    return [_named("contestant", slug, known) for slug in sorted(set(slugs))]


def _scenarios(slugs: Sequence[str]) -> list[Scenario]:
    known = {row.slug: row for row in Scenario.objects.only("slug")}
    chosen = [_named("scenario", slug, known) for slug in sorted(set(slugs))]
    # Held, so that no picture is drawn anew between its choice and the opening.
    held = Scenario.objects.filter(pk__in=[row.pk for row in chosen])
    list(held.select_for_update(no_key=True).order_by("pk").values_list("pk"))
    return chosen


def _experts(usernames: Sequence[str]) -> list[User]:
    known = {user.username: user for user in expert_accounts()}
    return [_named("expert", username, known) for username in sorted(set(usernames))]


def _named(kind: str, name: str, known: dict[str, Any]) -> Any:
    if name not in known:
        raise UnknownName(kind, name, sorted(known))
    return known[name]


def _has_simulated(
    contestants: list[Contestant], experts: list[User], *, are_allowed: bool
) -> bool:
    """Return whether a simulated contestant or expert takes part; refused where none may."""
    simulated = [f"contestant {row.slug}" for row in contestants if row.is_simulated] + [
        f"expert {user.username}" for user in experts if user.person.is_simulated
    ]
    if simulated and not are_allowed:
        raise Conflict(
            f"Simulated: {', '.join(simulated)}. They never mix into a rating unless the "
            "study allows simulated contestants and votes."
        )
    return bool(simulated)


def _checks_for(
    study_plan: StudyPlan, scenarios: list[Scenario], entries: tuple[Entry, ...]
) -> tuple[tuple[Check, ...], Cells]:
    """The attention checks that are asked for, where the plan shows them."""
    share = study_plan.checks / 100
    check_share(ATTENTION_CHECKS, share, MOST_CHECKS)
    wanted = round(share * study_plan.votes_per_expert)
    found = enough_checks(scenarios, windows=windows_of(entries), wanted=wanted)
    return placed_checks(*found, shows_all=study_plan.samples is SampleRule.ALL)


def _entries(shown: Cells) -> tuple[Entry, ...]:
    return tuple(
        Entry(scenario=scenario, contestant=contestant, picture=cell.image, sample=cell.sample)
        for (scenario, contestant), cell in sorted(shown.items())
    )


def _rules(study_plan: StudyPlan, entries: tuple[Entry, ...], experts: list[User]) -> PlanRules:
    """What the planner is told, but for checks and settled pairs."""
    appearances, pair_votes = read_targets(study_plan.targets)
    return PlanRules(
        entries=entries,
        experts=tuple(expert.username for expert in experts),
        votes_per_expert=study_plan.votes_per_expert,
        seed=study_plan.seed,
        appearances=appearances,
        pair_votes=pair_votes,
        **study_plan.shares,
    )


# --- What is kept ------------------------------------------------------------------------------


def _insert(
    name: str, frozen: dict[str, Any], study_plan: StudyPlan, rules: PlanRules, has_simulated: bool
) -> Study:
    switches = {column: getattr(study_plan, column) for column in SWITCH_COLUMNS}
    try:
        with transaction.atomic():
            return Study.objects.create(
                name=name,
                state=Study.State.OPEN,
                votes_per_expert=rules.votes_per_expert,
                seed=rules.seed,
                rules=frozen,
                **(switches | {"allow_simulated": has_simulated}),
                votes_to_plan=(
                    dict.fromkeys(rules.experts, rules.votes_later) if rules.votes_later else {}
                ),
                opened_at=timezone.now(),
            )
    except IntegrityError:  # somebody else was faster
        raise _taken(name) from None


def _alike(
    study_plan: StudyPlan, cells: Cells, entries: Sequence[Entry]
) -> tuple[tuple[Triple, ...], dict[str, Any]]:
    """Which alike pairs are settled, and as a rule of the study which are shown all the same."""
    alike = () if study_plan.show_alike else alike_pairs(cells)
    alike_shown = draw_shown(alike, entries, seed=study_plan.seed)
    kept = {"alike_shown": [list(pair) for pair in alike_shown]}
    return tuple(sorted(set(alike) - set(alike_shown))), kept


def _enrol(
    study: Study, contestants: list[Contestant], scenarios: list[Scenario], experts: list[User]
) -> None:
    study.contestants.set(contestants)
    study.scenarios.set(scenarios)
    study.experts.set(experts)


def _frozen_pictures(study_plan: StudyPlan, shown: StudyPictures) -> dict[str, Any]:
    """Which pictures are shown: the rule for samples, the jobs they come from, the options.

    Beside them what is expected of their contestants.

    Raises:
        NothingToPlan: A hypothesis can't be read.
    """
    contestants = sorted({contestant for _, contestant in shown.cells})
    hypotheses = read_hypotheses(study_plan.hypotheses, contestants)
    # Kept where it departs from the default, so that the settings can be used again.
    alike = {"show_alike": True} if study_plan.show_alike else {}
    return alike | {
        "hypotheses": [one.as_document() for one in hypotheses],
        "samples": study_plan.samples.value,
        "jobs": [{"code": str(job.code), "name": job.name} for job in shown.jobs],
        "options": dict(sorted(shown.options.items())),
    }


def _conclude_opening(study: Study, *, matchups: int, actor: User | None) -> None:
    if study.practice:
        require_practice_pictures()
    preregister(study)
    log_event(
        actor=actor,
        verb="open",
        object_kind="study",
        object_code=study.code,
        after={"name": study.name, "matchups": matchups, "seed": study.seed},
    )


def _taken(name: str) -> Conflict:
    return Conflict(f"There is a study named '{name}' already.")


def _frozen_rules(
    rules: PlanRules, planned: MatchupPlan, played: Replays | None
) -> dict[str, Any]:
    """Everything that the plan came from, what it had to give up, and which drives are played."""
    kept: dict[str, Any] = {"planner": PLANNER, **asdict(rules)}
    kept["scenario_gap_kept"] = planned.scenario_gap
    kept["identical"] = [list(triple) for triple in planned.identical]
    if played is not None:
        kept["replays"] = asdict(played)
    return kept
