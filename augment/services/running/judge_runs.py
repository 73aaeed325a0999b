"""Runs of judges: models that compare pairs of pictures, each pair in both orders, within caps.

In: pairs of augmentations with the pictures that experts saw. Out: a `PairJudgement` row each,
with its calls as `ModelCall` rows. What a judge says is no vote and is rated nowhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import NamedTuple

from django.contrib.auth.models import User
from django.core.files.storage import default_storage
from django.db import transaction
from django.db.models import Avg, Exists, OuterRef, Q, QuerySet

from augment import errors
from augment.llm.client import ChatClient
from augment.llm.costs import to_usd
from augment.llm.messages import shorten
from augment.models import JudgeRun, ModelCall, PairJudgement
from augment.prompts.fill import JudgeQuestion, Shown
from augment.render.film import FRAMES_S, draw_frames
from augment.services import clock, events, inputs, texts, work
from augment.services.endpoints.client import EndpointClient, Queue, wire_to
from augment.services.endpoints.contestants import Respondent
from augment.services.endpoints.known_endpoints import find_endpoint
from augment.services.running import budget
from augment.services.running.budget import Caps
from augment.services.running.calls import CallTranscript
from augment.services.scenarios.pictures import film_document
from augment.variants.judge import UNREADABLE, ask_judge, most_nano_usd
from augment.variants.judge import Exchange as Exchange
from augment.variants.judge import combine_answers as combine_answers
from augment.variants.judge import exchange as exchange
from augment.variants.respondents import ModelRole

State = PairJudgement.State
RunState = JudgeRun.State

ORDERS = 2
"""So often each pair is asked about."""
LONGEST_WHY = 1000


class ShownPair(NamedTuple):
    """A pair as experts saw it: keys of two augmentations, and names of their pictures."""

    left_id: int
    right_id: int
    left_image: str
    right_image: str


@dataclass(frozen=True, kw_only=True)
class JudgeRequest(Caps):
    """A new run of a judge."""

    endpoint: str = inputs.input_field(inputs.InputKind.TEXT, "Endpoint", "Its label.")
    model: str = inputs.input_field(inputs.InputKind.TEXT, "Model", "Its id there.")
    question: str = inputs.input_field(
        inputs.InputKind.CHOICE,
        "Question",
        choices={question.value: question.value.capitalize() for question in JudgeQuestion},
        default=JudgeQuestion.INSTRUCTION.value,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgeEstimate:
    """Estimate of a run; calls that break and are sent again come on top.

    Attributes:
        usd: By what earlier answers of this judge took, None without any or without a price.
        most_usd: The worst case, None without a price.
    """

    pairs: int
    calls: int
    usd: Decimal | None
    most_usd: Decimal | None


def estimate_judge(request: JudgeRequest, pairs: int, longest: str) -> JudgeEstimate:
    """Return the estimate of a run; `longest` is the longest instruction of its pairs.

    Raises:
        UnknownName: No such endpoint.
        Conflict: The model can't see pictures.
    """
    judge = _find_judge(request)
    calls, price = ORDERS * pairs, judge.price
    usd = most = None
    if price is not None:
        most = to_usd(calls * most_nano_usd(longest, price))
        used = ModelCall.objects.filter(
            **{"judgement__run__endpoint": judge.endpoint, "judgement__run__model": judge.model},
            served_from=None,
        ).aggregate(prompt=Avg("prompt_tokens"), completion=Avg("completion_tokens"))
        if None not in used.values():
            tokens = {f"{name}_tokens": round(mean) for name, mean in used.items()}
            usd = to_usd(calls * price.nano_usd(**tokens))
    return JudgeEstimate(pairs=pairs, calls=calls, usd=usd, most_usd=most)


@transaction.atomic
def plan_judge(
    request: JudgeRequest, pairs: Sequence[ShownPair], actor: User | None = None
) -> JudgeRun:
    """Create the rows of a run; workers do the rest.

    Raises:
        UnknownName: No such endpoint.
        InvalidDocument: A cap can't be.
        Conflict: There is no pair, the model can't see, or a cap in USD lacks a price.
    """
    judge = _find_judge(request)
    if not pairs:
        raise errors.Conflict(
            "No pair was judged by experts yet, so there is nothing to compare with."
        )
    unpriced = [] if judge.price else [str(judge)]
    run = JudgeRun.objects.create(
        endpoint=judge.endpoint,
        model=judge.model,
        question=request.question,
        frames=len(FRAMES_S),
        asked_by=actor,
        **budget.cap_columns(request, unpriced),
    )
    PairJudgement.objects.bulk_create(PairJudgement(run=run, **pair._asdict()) for pair in pairs)
    facts = {"model": run.model, "endpoint": judge.endpoint.label, "pairs": len(pairs)}
    events.log_change(run, "start", actor, after=facts | {"cap": budget.describe_caps(run)})
    return run


@transaction.atomic
def cancel_judge(run: JudgeRun, actor: User | None = None) -> None:
    """Ask nothing more; what was answered stays.

    Raises:
        Conflict: It is over already.
    """
    work.change_all(
        PairJudgement.objects.filter(run=run, state=State.QUEUED),
        state=State.CANCELLED,
        finished_at=clock.DATABASE_TIME,
    )
    open_runs = JudgeRun.objects.filter(
        pk=run.pk, state__in=(RunState.RUNNING, RunState.STOPPED_AT_CAP)
    )
    if not open_runs.update(state=RunState.CANCELLED, finished_at=clock.DATABASE_TIME):
        raise errors.Conflict("This judge is done already.")
    events.log_change(run, "cancel", actor)


def finish_judges(*, now: clock.Moment = clock.DATABASE_TIME) -> None:
    """Finish the runs in which nothing is under way; after an outcome is committed."""
    rows = PairJudgement.objects.filter(run=OuterRef("pk"), state__in=PairJudgement.UNDER_WAY)
    over = JudgeRun.objects.filter(~Exists(rows), state=RunState.RUNNING)
    over.update(state=RunState.FINISHED, finished_at=now)


class Judgements(work.WorkKind[PairJudgement]):
    """Pairs that a judge is to compare."""

    model = PairJudgement
    queue = "models"
    priority = 6
    related = ("run__endpoint", "left__scenario")

    def waiting(self) -> QuerySet[PairJudgement]:
        """Return waiting judgements; none of a run that was cancelled or stopped at its cap."""
        return super().waiting().filter(run__state=RunState.RUNNING)

    def run(self, row: PairJudgement, held: work.Lease[PairJudgement]) -> work.Settlement:
        """Ask in both orders; an answer that was stored before is not paid for again."""
        endpoint = row.run.endpoint
        transcript = CallTranscript(
            held,
            {"judgement": row},
            {ModelRole.JUDGE: Respondent(endpoint=endpoint, model=row.run.model)},
            JudgeRun.objects.filter(pk=row.run_id),
            numbers=row.calls.count(),  # a worker that was lost may have asked already
        )
        queue = Queue(still_wanted=transcript.insist)
        pictures = _read_shown(row.run, row.left_image), _read_shown(row.run, row.right_image)
        columns: dict[str, str] = {}
        with EndpointClient(wire_to(endpoint), endpoint, queue) as client:
            for order, shown in (("first", pictures), ("second", pictures[::-1])):
                better, reason = _ask(row, shown, client, transcript)
                columns |= {order: better, f"{order}_reason": reason}
        return work.Settlement(state=State.DONE, columns=columns)

    def on_finish(self, pk: int, end: str, reason: str, now: clock.Moment) -> None:
        """Settle its calls in flight."""
        budget.settle_unseen(of=Q(judgement=pk), now=now)

    def after_commit(self, row: PairJudgement, outcome: work.Settlement | None) -> None:
        """Finish the run."""
        finish_judges()

    def cleanup(self, now: clock.Moment) -> None:
        """Finish the runs that are over."""
        finish_judges(now=now)


JUDGEMENTS = Judgements()


# --- Private -----------------------------------------------------------------------------------


def _find_judge(request: JudgeRequest) -> Respondent:
    """Return who is asked for; a model that can't see is refused."""
    judge = Respondent(endpoint=find_endpoint(request.endpoint), model=request.model)
    if judge.facts.vision is False:
        raise errors.Conflict(
            f"{request.model} at {judge.endpoint.label} can’t see pictures, so it can’t judge "
            "them. Choose another model; where this is wrong, probe the model again."
        )
    return judge


def _read_shown(run: JudgeRun, name: str) -> Shown:
    """Return a picture, and of what moves the sheet of frames, where the run shows one."""
    still, film = _read_picture(name), film_document(name) if run.frames else None
    return (still,) if film is None else (still, draw_frames(film, _read_picture(film["ground"])))


def _read_picture(name: str) -> bytes:
    """Return the bytes of a stored picture.

    Raises:
        Conflict: It is gone.
    """
    if not name or not default_storage.exists(name):
        raise errors.Conflict(
            f"The picture {name!r}, which experts were shown, is not stored any more."
        )
    with default_storage.open(name) as file:
        return bytes(file.read())


def _ask(
    row: PairJudgement,
    pictures: tuple[Shown, Shown],
    client: ChatClient,
    transcript: CallTranscript,
) -> tuple[str, str]:
    """Return the answer in one order and its reason; a refusal is as unreadable as babble."""
    try:
        answer = ask_judge(
            JudgeQuestion(row.run.question),
            row.left.scenario.wording,
            pictures,
            client=client,
            model=row.run.model,
            transcript=transcript,
        )
    except (errors.ReplyUnreadable, errors.ModelRefused) as fault:
        return UNREADABLE, shorten(texts.make_storable(str(fault)), LONGEST_WHY)
    reason = " ".join(texts.make_storable(answer.reason or "").split())
    return answer.better, shorten(reason, LONGEST_WHY)
