"""Probes of a model at an endpoint: asked over the real wire, and written into its row.

A fault that says nothing about the ability (a busy server) leaves the ability as it was.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from decimal import Decimal
from typing import Any

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from augment.errors import Conflict, ModelFault, ParameterRefused
from augment.llm.client import ChatClient, ModelProfile
from augment.llm.costs import find_cut, to_usd
from augment.llm.messages import LengthName, Reply, Request, SchemaForm, shorten
from augment.llm.questions import Ability, ProbeQuestion, questions_for
from augment.llm.vendors import says
from augment.models import Contestant, Endpoint, EndpointModel, Probe
from augment.services import events, texts, work
from augment.services.endpoints.client import Queue, place_at, wire_to
from augment.services.endpoints.contestants import SAMPLING
from augment.services.endpoints.known_endpoints import EndpointRequest, add_endpoint, check_facts
from augment.services.endpoints.known_models import TEMPERATURE, find_price, model_at

ABILITIES = tuple(ability.value for ability in Ability)
"""What is asked about, in this order."""

_REFUSALS = frozenset({400, 404, 415, 422})
"""With these an endpoint answers to what it can't do; with others to how it is today."""

_STORED = (Ability.TEMPERATURE, Ability.NATIVE_TOOLS, Ability.VISION)
_LONGEST_NOTE = 200

LIST_WITHIN_S = 5.0
"""Somebody looks at a page meanwhile."""

MOST_LISTED = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeFinding:
    """Result of one question.

    Attributes:
        ability: Which.
        has_it: None where the answer does not tell.
        note: What the model said, or what broke.
    """

    ability: str
    has_it: bool | None
    note: str
    model_returned: str = ""
    prompt_tokens: int | None = None
    completion_tokens: int | None = None
    latency_s: float | None = None
    cost_usd: str | None = None


@dataclass(slots=True, kw_only=True)
class ProbeReport:
    """All findings, and what asking has cost as far as it is known.

    Attributes:
        refused: Parameters that the endpoint answered 400 to, or passed over.
        cost_usd: None where the price or a count of tokens is unknown.
    """

    probed_at: datetime
    findings: list[ProbeFinding] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    calls: int = 0
    cost_usd: str | None = None

    def has(self, ability: Ability) -> bool | None:
        """Return whether the model has the ability by all questions, None if nothing is known."""
        answers = [made.has_it for made in self.findings if made.ability == ability]
        return next((has_it for has_it in answers if not has_it), True if answers else None)


def probe(
    row: EndpointModel,
    *,
    actor: User | None = None,
    on_finding: Callable[[ProbeFinding], None] = lambda finding: None,
) -> ProbeReport:
    """Ask the questions and store what they show.

    Args:
        row: The model.
        actor: Who wants it.
        on_finding: Told what each question showed as soon as it is known.

    Raises:
        KeyNotAllowed, KeyMissing: The key's variable is not meant for keys, or not set here.
        ModelFault: The wire can't be opened.
    """
    report = ProbeReport(probed_at=timezone.now())
    with wire_to(row.endpoint) as wire:
        prober = _Prober(client=wire, row=row)
        for question in questions_for(row.model, _list_chosen_values(row)):
            report.findings.append(prober.ask(question))
            on_finding(report.findings[-1])
            if report.findings[0].latency_s is None:
                break  # nobody answers: the other questions would say the same
    report.refused, report.calls = sorted(prober.profile.refused - {TEMPERATURE}), prober.calls
    costs = [made.cost_usd for made in report.findings if made.latency_s is not None]
    if costs and None not in costs:
        report.cost_usd = f"{sum(Decimal(cost) for cost in costs if cost):f}"
    _store(row, report, actor)
    return report


@transaction.atomic
def add_model(endpoint: Endpoint, *, model: str, actor: User | None = None) -> Probe:
    """Add a model of an endpoint with its listed price; the caller sends its probe's message.

    Raises:
        InvalidDocument: The model id can't be used.
        Conflict: The endpoint has it already.
    """
    model = texts.one_line("model", model, what="endpoint")
    if endpoint.models.filter(model=model).exists():
        raise Conflict(f"{endpoint.label} has the model {model} already.")
    row = model_at(endpoint=endpoint, model=model)
    events.log_change(row, "add", actor, after={"model": model, "endpoint": endpoint.label})
    return plan_probe(row, actor=actor)


def ensure_model(request: EndpointRequest, *, model: str) -> EndpointModel:
    """Return a model that was probed, added with its endpoint where it answers.

    Raises:
        InvalidDocument: The address or the variable of its key can't be used.
        KeyMissing: The variable is not set here.
        ModelFault: It does not answer; no row is made then.
    """
    facts = check_facts(request)
    where = {name: facts[name] for name in ("base_url", "key_variable", "is_simulated")}
    endpoint = Endpoint.objects.filter(**where).first()
    known = EndpointModel.objects.filter(endpoint=endpoint, model=model).exclude(probed_at=None)
    if row := known.first():
        return row
    with wire_to(Endpoint(**facts)) as wire:
        try:
            with suppress(ParameterRefused):
                wire.complete(questions_for(model)[0].request)
        except ModelFault as fault:
            hint = "Is its base URL right, up to /v1?" if fault.status in (None, 404) else ""
            with suppress(ModelFault):  # many endpoints list none
                hint = f"It lists: {', '.join(wire.list_models()[:MOST_LISTED])}."
            fault.args = (f"{fault}. {hint}".strip(),)
            raise
    row = model_at(endpoint=endpoint or add_endpoint(request), model=model)
    probe(row)
    row.refresh_from_db()
    return row


def list_models(endpoint: Endpoint) -> list[str]:
    """Return the ids of the models that an endpoint lists, soon or not at all.

    Raises:
        KeyNotAllowed, KeyMissing: The key's variable is not meant for keys, or not set here.
        ModelFault: It lists none.
    """
    with wire_to(endpoint, timeout_s=LIST_WITHIN_S) as wire:
        return wire.list_models()


def plan_probe(model: EndpointModel, *, actor: User | None = None) -> Probe:
    """Create the row of a probe that nobody has made yet; the caller sends its message.

    Raises:
        Conflict: One is under way at this model.
    """
    try:
        with transaction.atomic():
            return Probe.objects.create(model=model, asked_by=actor)
    except IntegrityError:
        raise Conflict(f"{model.model} is being probed already; wait for its end.") from None


class Probes(work.WorkKind[Probe]):
    """Probes that somebody asked for; what each question showed stands in the row at once."""

    model = Probe
    queue = "models"
    lost_limit = 1  # it may have been paid for
    related = ("model__endpoint", "asked_by")

    def run(self, row: Probe, held: work.Lease[Probe]) -> work.Settlement:
        """Ask every question."""

        def keep(finding: ProbeFinding) -> None:
            row.findings.append(texts.make_document_storable(asdict(finding)))
            held.note(findings=row.findings)

        row.findings = []
        probe(row.model, actor=row.asked_by, on_finding=keep)
        return work.Settlement(state=Probe.State.DONE)


PROBES = Probes()


# --- Private -----------------------------------------------------------------------------------


class _Prober:
    """Asks within the endpoint's limits, and goes without what it was refused."""

    def __init__(self, *, client: ChatClient, row: EndpointModel) -> None:
        self._client, self._row = client, row
        self._price = find_price(row)
        self.calls = 0
        self.profile = ModelProfile(
            reasoning_effort=row.reasoning_effort, max_output_tokens=row.max_output_tokens
        )

    def ask(self, question: ProbeQuestion) -> ProbeFinding:
        ability = question.ability
        try:
            request, reply = self._answer(question)
        except ParameterRefused as refused:
            self.profile = self.profile.without(refused.parameter)
            return ProbeFinding(ability=ability, has_it=False, note=_short(str(refused)))
        except ModelFault as fault:
            # A value that is not taken says nothing of others.
            is_other = ability in (Ability.ANSWERS, Ability.TEMPERATURE)
            lacks_schema = self.profile.refused.issuperset(SchemaForm)
            refuses = fault.status in _REFUSALS or says("lacks", str(fault))
            refuses &= not is_other
            refuses |= ability == Ability.SCHEMA and lacks_schema
            has_it = False if refuses or ability == Ability.ANSWERS else None
            return ProbeFinding(ability=ability, has_it=has_it, note=_short(str(fault)))
        cut = find_cut(request, reply, context_tokens=self._row.context_tokens)
        # What a filter withheld tells of no ability.
        is_good = cut is None and (None if reply.refusal else question.is_good(reply))
        if is_good is False and ability in (Ability.ANSWER_LIMIT, Ability.SCHEMA):
            # Some servers pass over a parameter that they do not know instead of refusing it.
            is_limit = ability == Ability.ANSWER_LIMIT
            other = self.profile.without(request.length_name if is_limit else request.schema_form)
            is_last = other.refused.issuperset(LengthName if is_limit else SchemaForm)
            self.profile = self.profile if is_limit and is_last else other
            if not is_last:
                return replace(self.ask(question), cost_usd=None)
        calls = ", ".join(f"{call.name}({call.arguments})" for call in reply.tool_calls)
        text = str(cut) if cut else reply.text or reply.refusal or calls
        return ProbeFinding(
            ability=ability,
            # Any answer shows that the parameter is taken.
            has_it=ability in (Ability.ANSWERS, Ability.TEMPERATURE) or is_good,
            note=_short("; ".join((text, *reply.remarks) if text else reply.remarks)),
            model_returned=reply.model,
            prompt_tokens=reply.prompt_tokens,
            completion_tokens=reply.completion_tokens,
            latency_s=reply.latency_s,
            cost_usd=self._cost_usd(reply),
        )

    def _answer(self, question: ProbeQuestion) -> tuple[Request, Reply]:
        """Return the request as it was sent, and its answer; goes without what is refused."""
        while True:
            request = self.profile.fit(question.request)
            try:
                with place_at(self._row.endpoint, Queue()):
                    self.calls += 1
                    return request, self._client.complete(request)
            except ParameterRefused as refused:
                if refused.parameter == question.parameter:
                    raise
                self.profile = self.profile.without(refused.parameter)

    def _cost_usd(self, reply: Reply) -> str | None:
        prompt, completion = reply.prompt_tokens, reply.completion_tokens
        if self._price is None or prompt is None or completion is None:
            return None
        nano_usd = self._price.nano_usd(
            prompt_tokens=prompt,
            completion_tokens=completion,
            cached_tokens=reply.cached_tokens or 0,
        )
        return f"{to_usd(nano_usd):f}"


def _list_chosen_values(row: EndpointModel) -> list[dict[str, Any]]:
    """Return the parameters that contestants send the model, each set of values once."""
    rows = Contestant.objects.filter(endpoint=row.endpoint, model=row.model, retired_at=None)
    chosen = [
        {name: options[name] for name in sorted(SAMPLING & options.keys())}
        for options in rows.values_list("options", flat=True)
    ]
    return [values for n, values in enumerate(chosen) if values and values not in chosen[:n]]


def _short(text: str) -> str:
    return shorten(" ".join(text.split()), _LONGEST_NOTE)


@transaction.atomic
def _store(row: EndpointModel, report: ProbeReport, actor: User | None) -> None:
    """Write the report, and each ability that it tells of."""
    document = asdict(report) | {"probed_at": report.probed_at.isoformat()}
    abilities = {ability.value: report.has(ability) for ability in _STORED}
    changes: dict[str, Any] = {
        "probed_at": report.probed_at,
        "probe_report": texts.make_document_storable(document),
        **{name: has_it for name, has_it in abilities.items() if has_it is not None},
    }
    if report.has(Ability.ANSWERS):
        changes["refused_parameters"] = report.refused
    EndpointModel.objects.filter(pk=row.pk).update(**changes)
    events.log_change(
        row,
        "probe",
        actor,
        after={"model": row.model, "calls": report.calls, "cost_usd": report.cost_usd} | abilities,
    )
