"""Models that judge pairs: asked over the wire in both orders, blind, within caps, paid once."""

import base64
import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from PIL import Image

from augment.errors import Conflict
from augment.fake_llm.server import running
from augment.models import Augmentation, EndpointModel, JudgeRun, ModelCall, PairJudgement
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.endpoints.known_models import model_at, vendor_family
from augment.services.running import calls
from augment.services.running.judge_runs import (
    JUDGEMENTS,
    JudgeRequest,
    ShownPair,
    cancel_judge,
    estimate_judge,
    plan_judge,
)
from augment.services.scenarios.pictures import film_name, store, store_as
from augment.variants.judge import Exchange, combine_answers, exchange
from tests import study_rows
from tests.jobs.scripted import Scripted
from tests.llm.json_server import serving
from tests.web.cast import png

pytestmark = pytest.mark.django_db

State, Run = PairJudgement.State, JudgeRun.State
PICTURES = [png(1), png(2, width=200)]
ALPHA = "anthropic-alpha"


def says(better: str) -> str:
    block = json.dumps({"better": better, "reason": "It\nfits."})
    return f"Hm.\n```json\n{block}\n```"


@contextmanager
def judge(*script: str, vision: bool = True, **caps: Any) -> Iterator[tuple[Scripted, JudgeRun]]:
    """A run about one pair, at a server that says these things in turn."""
    usage: dict[str, int | None] = {"prompt_tokens": 1000, "completion_tokens": 10}
    with serving(Scripted(*script, usage=usage)) as server:
        endpoint = ensure_endpoint(EndpointRequest(label="here", base_url=server.url))
        known = model_at(endpoint=endpoint, model="m")
        known.vision, known.price_in_usd, known.price_out_usd = vision, Decimal(1), Decimal(2)
        known.save()
        yield server, start(**caps)


def start(**caps: Any) -> JudgeRun:
    request = JudgeRequest(endpoint="here", model="m", **caps)
    if not Augmentation.objects.exists():
        place = study_rows.scenario("place")
        for slug in (ALPHA, "beta"):
            study_rows.picture(place, study_rows.contestant(slug))
    left, right = Augmentation.objects.order_by("pk")
    images = [store(one) for one in PICTURES]
    return plan_judge(request, [ShownPair(left.pk, right.pk, *images)])


def work(run: JudgeRun) -> PairJudgement:
    row = run.judgements.get()
    JUDGEMENTS.perform(row.pk)
    run.refresh_from_db()
    row.refresh_from_db()
    return row


def images_of(body: dict[str, Any]) -> list[bytes]:
    parts = body["messages"][-1]["content"][1:]
    return [base64.b64decode(part["image_url"]["url"].partition(",")[2]) for part in parts]


def test_both_orders_are_asked_blind_and_each_call_is_kept_raw() -> None:
    with judge(says("A"), says("B")) as (server, run):
        row = work(run)
    assert [images_of(body) for body in server.bodies] == [PICTURES, PICTURES[::-1]]
    told = [[message["content"] for message in body["messages"]] for body in server.bodies]
    assert told[0][0] == told[1][0]
    assert "Park a car on place." in told[0][1][0]["text"]
    assert ALPHA not in json.dumps(server.bodies).lower()
    assert "beta" not in json.dumps(told[0][0]).lower()
    assert (row.state, row.first, row.first_reason, row.second) == ("done", "A", "It fits.", "B")
    assert [call.answer for call in row.calls.order_by("number")] == [says("A"), says("B")]
    assert (run.state, run.spent_calls, run.reserved_calls) == (Run.FINISHED, 2, 0)
    assert run.spent_usd == Decimal("0.00204")


def test_of_what_moves_four_frames_are_shown_beside_the_still() -> None:
    mark = [{"fill": "#2060c0", "points": [-200, -100, 200, -100, 200, 100, -200, 100]}]
    # From (300, 200) on, 2 px to the right each step; at 6 s it is turned by 90 degrees.
    moves = [3000, 2000, 0, *[20, 0, 0] * 59, 20, 0, 90]
    film = {"window": "w", "step_s": 0.1, "steps": 61, "width": 600, "height": 400}
    film |= {
        "ground": store(png(3, width=1200, height=800)),
        "marks": [mark],
        "movers": [[0, 0, 60, moves]],
    }
    picture = f"augmentations/w-film/{'a' * 64}.png"
    store_as(picture, PICTURES[0])
    store_as(film_name(picture), json.dumps(film).encode())
    with judge(says("A"), says("B"), *[says("A")] * 2) as (server, run):
        PairJudgement.objects.update(left_image=picture)
        work(run)
        PairJudgement.objects.all().delete()
        JudgeRun.objects.update(frames=0)  # as of runs before there were frames
        left, right = Augmentation.objects.order_by("pk")
        PairJudgement.objects.create(
            run=run, left=left, right=right, left_image=picture, right_image=store(PICTURES[1])
        )
        JudgeRun.objects.update(state=Run.RUNNING)
        work(run)
    still, sheet, other = images_of(server.bodies[0])
    assert (still, other) == tuple(PICTURES)
    assert images_of(server.bodies[1]) == [other, still, sheet]
    assert images_of(server.bodies[2]) == PICTURES
    told = server.bodies[0]["messages"][-1]["content"][0]["text"]
    assert told.endswith("1. picture A\n2. picture A\n3. picture B")
    shown = Image.open(io.BytesIO(sheet)).convert("RGB")
    assert shown.size == (1200, 800)
    blue = np.asarray(shown)[..., 2].astype(int) - np.asarray(shown)[..., 0] > 100
    for number, (x, wide) in enumerate([(330, 40), (360, 40), (390, 40), (420, 20)]):
        rows, columns = np.nonzero(blue[number // 2 * 400 :, number % 2 * 600 :][:400, :600])
        assert (columns.mean(), rows.mean()) == pytest.approx((x, 200), abs=1.0)
        assert np.ptp(columns) == pytest.approx(wide, abs=2)


def test_a_preference_counts_where_it_survives_the_exchange() -> None:
    for first, second, became, preference in (
        ("A", "B", Exchange.KEPT, 1),
        ("B", "A", Exchange.KEPT, -1),
        ("A", "A", Exchange.LOST, 0),
        ("B", "B", Exchange.LOST, 0),
        ("A", "equal", Exchange.LOST, 0),
        ("equal", "B", Exchange.LOST, 0),
        ("equal", "equal", Exchange.EQUAL, 0),
        ("unreadable", "B", Exchange.UNREADABLE, 0),
        ("equal", "unreadable", Exchange.UNREADABLE, 0),
    ):
        assert (exchange(first, second), combine_answers(first, second)) == (became, preference)


@pytest.mark.parametrize("babble", ["Both are nice.", says("C"), '```json\n{"reason": ""}\n```'])
def test_an_answer_that_nobody_can_read_is_asked_for_once_and_said(babble: str) -> None:
    with judge(babble, says("B")) as (server, run):
        row = work(run)
    assert (row.state, row.first, row.second) == (State.DONE, "unreadable", "B")
    assert row.first_reason.startswith("The answer can't be read")
    assert len(server.bodies) == 2


def test_a_cap_stops_the_run_and_the_next_one_pays_for_no_answer_twice() -> None:
    with judge(says("A"), says("B"), cap_calls=1) as (server, run):
        assert work(run).state == State.QUEUED
        assert (run.state, len(server.bodies)) == (Run.STOPPED_AT_CAP, 1)
        assert not JUDGEMENTS.perform(run.judgements.get().pk)
        again = start()
        assert work(again).state == State.DONE
        assert (again.spent_calls, len(server.bodies)) == (1, 2)


def test_who_is_killed_leaves_its_answers_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = calls.CallTranscript.sending

    def die_at_the_second(self: calls.CallTranscript, number: int) -> None:
        kept(self, number)
        if number == 2:
            raise SystemExit

    with judge(says("B"), says("A")) as (server, run):
        monkeypatch.setattr(calls.CallTranscript, "sending", die_at_the_second)
        with pytest.raises(SystemExit):
            work(run)
        monkeypatch.undo()
        row = work(run)
    assert (row.state, row.first, row.second) == (State.DONE, "B", "A")
    assert len(server.bodies) == 2
    seen = ModelCall.objects.filter(served_from=None).order_by("number")
    assert [(call.number, call.is_cost_estimated) for call in seen] == [
        *((1, False), (2, True), (4, False))
    ]
    assert (run.reserved_calls, run.spent_calls) == (0, 3)


def test_nothing_is_sent_to_a_model_that_can_not_see_or_lacks_a_price() -> None:
    with judge() as (server, run):
        cancel_judge(run)
        assert work(run).state == State.CANCELLED
        with pytest.raises(Conflict, match="done already"):
            cancel_judge(run)
        request = JudgeRequest(endpoint="here", model="other", cap_usd=Decimal(1))
        with pytest.raises(Conflict, match="nobody knows that of other at here"):
            plan_judge(request, [ShownPair(1, 2, "a", "b")])
        EndpointModel.objects.update(vision=False)
        with pytest.raises(Conflict, match="m at here can’t see pictures"):
            start()
        with pytest.raises(Conflict, match="No pair was judged by experts yet"):
            plan_judge(JudgeRequest(endpoint="here", model="other"), [])
    assert not server.bodies
    assert JudgeRun.objects.count() == 1


def test_an_estimate_counts_both_orders_and_learns_from_answers() -> None:
    with judge(says("A"), says("B")) as (_, run):
        request = JudgeRequest(endpoint="here", model="m")
        before = estimate_judge(request, 10, "Park.")
        work(run)
        after = estimate_judge(request, 10, "Park.")
    assert (before.calls, before.usd) == (20, None)
    assert before.most_usd > 20 * Decimal("0.08")
    assert after.usd == 20 * Decimal("0.00102")


def test_a_picture_that_is_gone_fails_its_pair_with_a_sentence() -> None:
    with judge() as (server, run):
        run.judgements.update(left_image="bev/gone.png")
        row = work(run)
    assert (row.state, run.state) == (State.FAILED, Run.FINISHED)
    assert row.reason.startswith("The picture 'bev/gone.png'")
    assert not server.bodies


@pytest.mark.parametrize(
    ("model", "first", "second"),
    [
        ("fake-good", "B", "A"),
        ("fake-prose", "unreadable", "unreadable"),
        ("fake-refuse", "unreadable", "unreadable"),
    ],
)
def test_the_stand_in_judges_by_what_it_is_sent(model: str, first: str, second: str) -> None:
    with judge() as (_, run), running() as stand_in:
        run.endpoint.base_url = stand_in.url
        run.endpoint.save()
        JudgeRun.objects.update(model=model)
        row = work(run)
    assert (row.first, row.second) == (first, second)


def test_a_family_is_the_vendor_or_the_first_word() -> None:
    for model, family in (
        ("gpt-4o-2024-08-06", "openai"),
        ("o3-mini", "openai"),
        ("claude-3-5-sonnet", "anthropic"),
        ("anthropic/claude-3.5-sonnet", "anthropic"),
        ("meta-llama/Llama-3.3-70B", "llama"),
        ("llama3.1:70b", "llama"),
        ("Qwen/Qwen2-VL-7B", "qwen"),
        ("fake-good", "fake"),
    ):
        assert vendor_family(model) == family
