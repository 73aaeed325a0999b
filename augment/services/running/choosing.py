"""Contestants and jobs by the names that people use, and scenarios that no job can run."""

from collections.abc import Iterable, Sequence

from django.db.models import Q

from augment.baselines.registry import PLACERS
from augment.errors import AugmentError, Conflict, UnknownName, check_names
from augment.llm.messages import SchemaForm
from augment.models import Contestant, GenerationJob, Scenario
from augment.services.benchmarks.submissions import refuse_unanswered
from augment.services.endpoints import contestants, known_endpoints
from augment.services.scenarios.choosing import ALL
from augment.services.texts import read_code
from augment.variants.options import ContestantOptions, ToolProtocol
from augment.variants.respondents import ModelRole
from augment.variants.reviews import BlockForm

Kind = Contestant.Kind

_MADE_HERE = (Kind.REFERENCE, Kind.RULE, Kind.LLM, Kind.SIMULATED)
_KINDS = (*_MADE_HERE, Kind.SUBMISSION)

EVERYWHERE = Q(kind__in=_MADE_HERE, error_rates__isnull=True) | Q(
    kind=Kind.BASELINE, slug__in=PLACERS
)
"""Whom a job can run on any scenario. Submissions answer for those of their benchmark, what humans
and outside baselines made is imported, contestants dropped since run no more."""


def find_obstacle(contestant: Contestant) -> str:
    """Return why no job can run a contestant, whatever the scenarios; empty where one can."""
    is_ours = contestant.kind == Kind.BASELINE and contestant.slug in PLACERS
    if not is_ours and (contestant.kind not in _KINDS or contestant.error_rates is not None):
        return "it was made elsewhere or is of an earlier version"
    if contestant.kind == Kind.SUBMISSION and not hasattr(contestant, "submission"):
        return "its submission is not in this installation"
    try:
        respondents = contestants.read_respondents(contestant)
        options = contestants.read_options(contestant)
    except AugmentError as error:
        return str(error)
    if contestant.endpoint is None:
        return ""
    for respondent in respondents.values():
        endpoint = respondent.endpoint
        if obstacle := known_endpoints.find_key_obstacle(endpoint.key_variable, endpoint.base_url):
            return obstacle
    modifier, viewer = respondents[ModelRole.MODIFIER], respondents.get(ModelRole.VIEWER)
    if contestant.frozen_options is None and (obstacle := _find_lack(options, modifier)):
        return obstacle
    # Two calls of every augmentation would be paid for before a blind viewer fails.
    sees = viewer is None or viewer.facts.vision
    if sees is None:
        return f"nobody knows whether its viewer {viewer} sees pictures: probe the model"
    if not sees:
        return f"its viewer {viewer} sees text alone; visual QA needs vision"
    return contestants.other_prompts(contestant.slug, options) or ""


def refuse_impossible(
    who: Sequence[Contestant], where: Sequence[Scenario], *, samples: int = 1
) -> None:
    """Refuse a job that can't run to its end.

    Raises:
        Conflict: Nothing is chosen, or a contestant can't run, or not on these scenarios.
    """
    if not who:
        raise Conflict("Choose at least one contestant.")
    if not where:
        raise Conflict("Choose at least one scenario.")
    obstacles = {row.slug: obstacle for row in who if (obstacle := find_obstacle(row))}
    if obstacles:
        reasons = "; ".join(f"{slug}: {obstacle}" for slug, obstacle in obstacles.items())
        raise Conflict(f"A job can't run {reasons}.")
    references = [row.slug for row in who if row.kind == Kind.REFERENCE]
    without = [row.slug for row in where if row.reference is None]
    if references and without:
        raise Conflict(
            f"{references[0]} can't run on scenarios without a reference modification: "
            f"{', '.join(without)}."
        )
    for row in who:
        if row.kind == Kind.SUBMISSION:
            refuse_unanswered(row, [scenario.slug for scenario in where], samples=samples)


def can_run(contestant: Contestant, where: Iterable[Scenario]) -> bool:
    """Return whether a job can run a contestant on every one of these scenarios."""
    try:
        refuse_impossible([contestant], list(where))
    except Conflict:
        return False
    return True


def resolve_contestants(slugs: Sequence[str]) -> list[str]:
    """Return the slugs; `all` stands for every contestant that runs everywhere and nobody retired.

    Raises:
        UnknownName: There is no contestant of that slug.
    """
    if list(slugs) == [ALL]:
        rows = Contestant.objects.filter(EVERYWHERE, retired_at=None)
        return list(rows.values_list("slug", flat=True))
    check_names("contestant", slugs, sorted(Contestant.objects.values_list("slug", flat=True)))
    return list(slugs)


def find_job(name_or_code: str) -> GenerationJob:
    """Return a job by its name or its code.

    Raises:
        UnknownName: There is none.
        Conflict: Several have that name.
    """
    wanted = Q(name=name_or_code) | Q(code=read_code(name_or_code))
    jobs = list(GenerationJob.objects.filter(wanted))
    if not jobs:
        names = GenerationJob.objects.values_list("name", flat=True)
        raise UnknownName("job", name_or_code, sorted(set(names)))
    if len(jobs) > 1:
        codes = ", ".join(str(job.code) for job in jobs)
        raise Conflict(f"{len(jobs)} jobs are called {name_or_code!r}; name one code: {codes}.")
    return jobs[0]


def _find_lack(options: ContestantOptions, modifier: contestants.Respondent) -> str:
    """Return what of a modifier's options its model is known not to do; empty for nothing."""
    facts = modifier.facts
    if options.protocol is ToolProtocol.NATIVE and facts.native_tools is False:
        return f"it is to call its function natively, and {modifier} has no native calls"
    if options.block is BlockForm.SCHEMA and {*SchemaForm} <= {*facts.refused_parameters}:
        return f"it is to write its block by a schema, and {modifier} keeps to none"
    return ""
