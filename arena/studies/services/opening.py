"""Opening a study, its preregistration, and its end: closed with results, or cancelled without.

The plan is stored before anybody can vote. The preregistration names nobody: experts are numbers
in the order of their names. Its SHA-256 stands in every export of the study.
"""

import hashlib
import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import StudyNotOpen
from arena.models import Question, Study
from arena.models.studies import one_question
from arena.pairing.plan import Check, Entry, MatchupPlan, PlanRules, plan
from arena.pairing.rules import ATTENTION_CHECKS, MOST_CHECKS, Triple, check_share, draw_shown
from arena.people.queries import experts as expert_accounts
from arena.rating.snapshot_document import VERSION as RESULTS_VERSION
from arena.rating.vote_columns import VERSION as VOTES_VERSION
from arena.studies.services.plan import SWITCH_COLUMNS, SWITCH_RULES, StudyPlan, read_hypotheses
from arena.studies.services.planning import store
from arena.voting.services import pictures, practice
from augment.errors import Conflict, check_names
from augment.models import Contestant, Scenario
from augment.services import check_prose, endpoints, judging, log_change, one_line, running

PLANNER = "balanced-2"
"""Name and version of the planner, kept with the rules so that a plan can be made again."""

FORMAT, VERSION = "scenario-arena/preregistration", 1
FILE_NAME = "preregistration.json"
LONGEST_WHY = 1_000

_ELSEWHERE = frozenset({"entries", "experts", "hypotheses", "stopping", "jobs", "options"})
"""Rules that have a place of their own in the preregistration, or name people."""

# --- Opening -----------------------------------------------------------------------------------


@transaction.atomic
def open_study(
    study_plan: StudyPlan,
    *,
    challengers: Sequence[str] = (),
    jobs_of: Mapping[str, Sequence[str]] | None = None,
    actor: User | None = None,
) -> Study:
    """Plan all matchups of a new study and open it.

    Args:
        study_plan: Who takes part, and by which rules; the same ones give the same plan.
        challengers: Contestants of whom every pair has one, whatever job their pictures are of;
            none for all pairs.
        jobs_of: By contestant the codes of the jobs whose pictures count, where not all do.
        actor: Who opens it, for the log.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        UnknownName: A contestant, scenario or expert does not exist.
        Conflict: The name is taken, the seed out of range, a question unknown, or something
            simulated unasked.
        NothingToPlan: A target or hypothesis can't be read; pictures, drives or checks are
            missing.
    """
    name = _check_new(study_plan)
    rateable = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
    by_slug = {row.slug: row for row in rateable}
    contestants = find_named("contestant", study_plan.contestants, by_slug)
    scenarios = _scenarios(study_plan)
    accounts = {user.username: user for user in expert_accounts()}
    experts = find_named("expert", study_plan.experts, accounts)
    has_simulated = _check_simulated(study_plan, contestants, experts)
    shown = pictures.choose_pictures(
        contestants,
        scenarios,
        seed=study_plan.seed,
        rule=study_plan.samples,
        jobs=[running.find_job(job) for job in study_plan.jobs],
        challengers=challengers,
        jobs_of=jobs_of or {},
    )
    rules, broken, alike_shown = _rules(
        study_plan, shown.cells, scenarios, experts, tuple(sorted(challengers))
    )
    planned = plan(rules)
    cells = broken | shown.cells
    frozen = _frozen(study_plan, rules, planned, shown, alike_shown)
    if study_plan.allow_replay:
        frozen["replays"] = pictures.replay_settings(cells)
    study = _insert(name, frozen, study_plan, rules, has_simulated)
    study.contestants.set(contestants)
    study.scenarios.set(scenarios)
    study.experts.set(experts)
    store(study, planned.matchups, cells, experts)
    text = json.dumps(_preregistration(study), indent=1, ensure_ascii=False, sort_keys=True)
    study.preregistration = text + "\n"
    study.save(update_fields=["preregistration"])
    after = {"name": study.name, "matchups": len(planned.matchups), "seed": study.seed}
    log_change(study, "open", actor, after=after)
    return study


def _check_new(study_plan: StudyPlan) -> str:
    """Return the name of a study that is not there yet, with a seed and questions that can be."""
    name = one_line("name", study_plan.name, what="study")
    if Study.objects.filter(name=name).exists():
        raise Conflict(f"There is a study named '{name}' already.")
    check_seed(study_plan.seed)
    check_questions(study_plan.questions or one_question())
    return name


def check_seed(seed: int) -> None:
    """Raise Conflict for a seed that no column takes."""
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")


def check_questions(questions: Sequence[str]) -> None:
    """Raise Conflict for what is not one to all of the known questions, each once."""
    keys = list(questions)
    if not keys or len(set(keys)) < len(keys) or not set(keys) <= set(Question.values):
        raise Conflict(
            f"Questions are one or more of {', '.join(Question.values)}, each once and the "
            f"primary one first, not {', '.join(map(str, keys)) or 'none'}."
        )


def _scenarios(study_plan: StudyPlan) -> list[Scenario]:
    by_slug = {row.slug: row for row in Scenario.objects.only("slug")}
    chosen = find_named("scenario", study_plan.scenarios, by_slug)
    # Locked, so that no picture is drawn anew between its choice and the opening.
    rows = Scenario.objects.filter(pk__in=[row.pk for row in chosen])
    list(rows.select_for_update(no_key=True).order_by("pk").values_list("pk"))
    return chosen


def find_named(kind: str, names: Iterable[str], rows: dict[str, Any]) -> list[Any]:
    """Return the objects of these names, sorted by them; raise UnknownName for an unknown one."""
    check_names(kind, names, sorted(rows))
    return [rows[name] for name in sorted(set(names))]


def _check_simulated(
    study_plan: StudyPlan, contestants: list[Contestant], experts: list[User]
) -> bool:
    """Return whether a simulated contestant or expert takes part; refused where none may."""
    simulated = [f"contestant {row.slug}" for row in contestants if row.is_simulated]
    simulated += [f"expert {user.username}" for user in experts if user.person.is_simulated]
    if simulated and not study_plan.allow_simulated:
        raise Conflict(
            f"Simulated: {', '.join(simulated)}. They never mix into a rating unless the "
            "study allows simulated contestants and votes."
        )
    return bool(simulated)


def _rules(
    study_plan: StudyPlan,
    cells: pictures.Cells,
    scenarios: list[Scenario],
    experts: list[User],
    challengers: tuple[str, ...],
) -> tuple[PlanRules, pictures.Cells, list[Triple]]:
    """Return the planner's rules, the pictures of checks, and alike pairs that are shown."""
    entries = tuple(
        Entry(scenario=scenario, contestant=contestant, picture=cell.image, sample=cell.sample)
        for (scenario, contestant), cell in sorted(cells.items())
    )
    shares = study_plan.shares
    check_share(ATTENTION_CHECKS, shares["check_share"], MOST_CHECKS)
    checks: tuple[Check, ...] = ()
    broken: pictures.Cells = {}
    if wanted := round(shares["check_share"] * study_plan.votes_per_expert):
        shows_all = study_plan.samples is pictures.SampleRule.ALL
        checks, broken = pictures.check_pictures(scenarios, shows_all=shows_all)
        pictures.require_checks(checks, wanted=wanted)
    alike = [
        triple
        for triple in (() if study_plan.show_alike else judging.alike_pairs(cells))
        if not challengers or not set(challengers).isdisjoint(triple[1:])
    ]
    alike_shown = draw_shown(alike, entries, seed=study_plan.seed)
    rules = PlanRules(
        entries=entries,
        experts=tuple(expert.username for expert in experts),
        votes_per_expert=study_plan.votes_per_expert,
        seed=study_plan.seed,
        checks=checks,
        alike=tuple(sorted(set(alike) - set(alike_shown))),
        challengers=challengers,
        **shares,
    )
    return rules, broken, alike_shown


def _frozen(
    study_plan: StudyPlan,
    rules: PlanRules,
    planned: MatchupPlan,
    shown: pictures.StudyPictures,
    alike_shown: list[Triple],
) -> dict[str, Any]:
    """Return everything that the plan came from, and what it had to give up."""
    contestants = sorted({contestant for _, contestant in shown.cells})
    hypotheses = read_hypotheses(study_plan.hypotheses, contestants)
    return {
        "planner": PLANNER,
        **{rule: value for rule, value in asdict(rules).items() if rule != "challengers" or value},
        "scenario_gap_kept": planned.scenario_gap,
        "identical": [list(triple) for triple in planned.identical],
        "alike_shown": [list(pair) for pair in alike_shown],
        "alike_within": judging.ALIKE,
        "windows": "pair",
        # Kept where it departs from the default, so that the settings can be used again.
        **{name: True for name in SWITCH_RULES if getattr(study_plan, name)},
        "hypotheses": [asdict(hypothesis) for hypothesis in hypotheses],
        "samples": study_plan.samples.value,
        "jobs": [{"code": str(job.code), "name": job.name} for job in shown.jobs],
        "options": dict(sorted(shown.options.items())),
    }


def _insert(
    name: str, frozen: dict[str, Any], study_plan: StudyPlan, rules: PlanRules, has_simulated: bool
) -> Study:
    switches = {column: getattr(study_plan, column) for column in SWITCH_COLUMNS}
    if practises := study_plan.practice and practice.has_practice():
        frozen["practice_for"] = practice.OF_LINKS
    try:
        with transaction.atomic():
            return Study.objects.create(
                name=name,
                votes_per_expert=rules.votes_per_expert,
                seed=rules.seed,
                rules=frozen,
                questions=list(study_plan.questions) or one_question(),
                opened_at=timezone.now(),
                **switches | {"allow_simulated": has_simulated, "practice": practises},
            )
    except IntegrityError:  # taken since it was looked up
        raise Conflict(f"There is a study named '{name}' already.") from None


# --- Preregistration ---------------------------------------------------------------------------


def preregistration_sha256(study: Study) -> str:
    """Return the hash of the file, empty where there is none."""
    content = study.preregistration.encode()
    return hashlib.sha256(content).hexdigest() if content else ""


def product_version() -> str:
    """Return the version of this installation."""
    with (settings.BASE_DIR / "pyproject.toml").open("rb") as file:
        return str(tomllib.load(file)["project"]["version"])


def _preregistration(study: Study) -> dict[str, Any]:
    rules = study.rules
    contestants = study.contestants.select_related("endpoint").order_by("slug")
    scenarios = study.scenarios.order_by("slug").values("slug", "type", "instruction")
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
        "rules": {name: value for name, value in rules.items() if name not in _ELSEWHERE},
        "choices": {name.removeprefix("allow_"): getattr(study, name) for name in SWITCH_COLUMNS},
        "contestants": [_contestant_document(row) for row in contestants],
        "scenarios": list(scenarios),
        "questions": [
            {"key": key, "text": str(Question(key).label), "is_primary": key == study.questions[0]}
            for key in study.questions
        ],
        "jobs": rules["jobs"],
        "pictures": rules["entries"],
        "plan": _plan_document(study),
        "hypotheses": rules["hypotheses"],
        "analysis": {
            "method": "Bradley-Terry on the Elo scale, ties half a win, mean 1000",
            "intervals": "95 %, bootstrap with random effects of experts and of scenarios",
            "pairs": "all judged at once, 5 % for the whole table",
            "questions": "each rated by its own votes, never averaged",
            "settled_pairs": "ties, as many a pair as others have votes on average",
            "left_out": "hidden repeats, attention checks, skips, superseded votes",
        },
    }


def _contestant_document(row: Contestant) -> dict[str, Any]:
    names = ("slug", "name", "kind", "variant", "model", "roles")
    options = endpoints.read_options(row).to_document() if row.endpoint else None
    return {name: getattr(row, name) for name in names} | {"options": options}


def _plan_document(study: Study) -> dict[str, Any]:
    """Return the planned showings as one hash.

    Of each its expert's number, place, kind, scenario, left and right count.
    """
    numbers = {name: number for number, name in enumerate(sorted(study.rules["experts"]), 1)}
    rows = study.matchups.values_list(
        *("expert__username", "position", "kind", "scenario__slug"),
        *("left__contestant__slug", "left__sample"),
        *("right__contestant__slug", "right__sample"),
    )
    lines = sorted((numbers[name], *rest) for name, *rest in rows)
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    return {"matchups": len(lines), "sha256": hashlib.sha256(text.encode()).hexdigest()}


# --- The end -----------------------------------------------------------------------------------


@transaction.atomic
def close_study(*, study: Study, actor: User | None = None) -> Study:
    """Take no more votes; results may be read from now on. Closing twice changes nothing.

    Raises:
        StudyNotOpen: The study was cancelled.
    """
    return _end(study, Study.State.CLOSED, "close", actor)


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
    return _end(study, Study.State.CANCELLED, "cancel", actor, **({"why": why} if why else {}))


def _end(study: Study, state: Study.State, verb: str, actor: User | None, **more: str) -> Study:
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == state:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study '{study.name}' is {study.state} already.")
    # A vote holds its matchup's row until it is stored: no vote arrives after the end.
    list(study.matchups.select_for_update().order_by("pk").values_list("pk", flat=True))
    study.state, study.closed_at = state, timezone.now()
    study.save(update_fields=["state", "closed_at"])
    before = {"state": Study.State.OPEN.value}
    log_change(study, verb, actor, before=before, after={"state": state.value, **more})
    return study
