"""Judge models and fault labels: what machines and experts say of the same pictures."""

from collections.abc import Iterator
from decimal import Decimal

import pytest
from django.contrib.auth.models import User
from django.core.management import call_command
from django.test import Client
from django.urls import reverse
from pytest_django import DjangoCaptureOnCommitCallbacks

from arena.jobs.services import open_labelling
from arena.models import FaultLabel, LabellingRound, Matchup, Study, Vote
from arena.results.queries.judges import judge_preferences, list_judged_pairs, list_models
from arena.results.services.ratings import rate_now
from augment import tasks
from augment.fake_llm.server import running
from augment.models import (
    Augmentation,
    Contestant,
    Endpoint,
    EndpointModel,
    GenerationJob,
    JudgeRun,
    PairJudgement,
    Scenario,
)
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.running.judge_runs import JUDGEMENTS
from augment.services.scenarios.pictures import store
from tests import study_rows
from tests.brokers import Broker
from tests.exports.test_displacement import a_job
from tests.study_rows import expert
from tests.web.cast import people, png, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    """Two experts always prefer the picture of which more is drawn, on two scenarios."""
    made = study_rows.a_study(votes_per_expert=6, scenarios=2)
    for number, row in enumerate(Augmentation.objects.order_by("pk")):
        study_rows.hang(row, store(png(number) + bytes(number)))
    return study_rows.vote_all(
        made, lambda pair: "left" if pair.left_id > pair.right_id else "right"
    )


@pytest.fixture
def endpoint() -> Iterator[Endpoint]:
    with running() as server:
        made = ensure_endpoint(EndpointRequest(label="stand-in", base_url=server.url))
        Endpoint.objects.update(is_simulated=True)
        for name in ("fake-good", "fake-careless"):
            known = model_at(endpoint=made, model=name)
            known.vision, known.price_in_usd, known.price_out_usd = True, Decimal(1), Decimal(1)
            known.save()
        yield made


def start(client: Client, study: Study, model: str, **more: str) -> str:
    judge = str(EndpointModel.objects.get(model=model).code)
    answer = client.post(
        reverse("judge-start", args=[study.code]), {"judge": judge, **more}, follow=True
    )
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


def page(client: Client, study: Study) -> str:
    answer = client.get(reverse("results-judges", args=[study.code]))
    return " ".join(answer.content.decode().split())


def test_a_judge_is_estimated_started_worked_and_shown(
    study: Study,
    endpoint: Endpoint,
    broker: Broker,
    django_capture_on_commit_callbacks: DjangoCaptureOnCommitCallbacks,
    admin: Client,
) -> None:
    asked = start(admin, study, "fake-good")
    assert "Calls: 12, each pair in both orders" in asked
    assert "Cost: at most 2." in asked
    assert not JudgeRun.objects.exists()
    with django_capture_on_commit_callbacks(execute=True):
        assert "is asked about 6 pairs" in start(admin, study, "fake-good", sure="1")
    assert len(broker) == 6
    shown = page(admin, study)
    assert "0 of 6" in shown
    assert "Cancel" in shown
    run = study.judges.get()
    for pk in run.judgements.values_list("pk", flat=True):
        tasks.work.run(JUDGEMENTS.name, pk)
    shown = page(admin, study)
    assert "Closest to the experts: Judge fake-good at stand-in (simulated), in agree" in shown
    assert 'class="badge is-simulated"' in shown
    assert "50 %" in shown
    answers = admin.get(reverse("judge-answers", args=[study.code, run.code])).content.decode()
    head, first, second, *rest = answers.splitlines()
    assert head.split(",")[:4] == ["judge", "question", "scenario", "order"]
    assert first.split(",")[4:6] == second.split(",")[5:3:-1]
    assert len(rest) == 10


def test_a_judge_can_be_cancelled_and_is_for_staff_alone(study: Study, endpoint: Endpoint) -> None:
    accounts = people()
    admin, researcher = signed_in(accounts["admin"]), signed_in(accounts["researcher"])
    start(admin, study, "fake-good", sure="1")
    run = study.judges.get()
    assert researcher.get(reverse("results-judges", args=[study.code])).status_code == 200
    cancelling = reverse("judge-cancel", args=[study.code, run.code])
    assert researcher.post(cancelling).status_code == 403
    expert = signed_in(study.experts.get(username="eva"))
    assert expert.get(reverse("results-judges", args=[study.code])).status_code == 403
    assert "Cancelled" in admin.post(cancelling, follow=True).content.decode()
    Study.objects.update(state="open")
    assert admin.get(reverse("results-judges", args=[study.code])).status_code == 403


def test_what_is_refused_is_said_before_anything_is_asked(
    study: Study, endpoint: Endpoint, admin: Client
) -> None:
    EndpointModel.objects.update(vision=False)
    assert "can’t see pictures" in start(admin, study, "fake-good", sure="1")
    assert "Question: Select a valid choice" in start(
        admin, study, "fake-good", question="realism"
    )
    assert not JudgeRun.objects.exists()


def test_no_rating_counts_a_judge_and_each_pair_is_asked_about_once(
    study: Study, endpoint: Endpoint, capsys: pytest.CaptureFixture[str]
) -> None:
    before, votes = rate_now(study=study, rounds=50, seed=1), Vote.objects.count()
    pairs = list_judged_pairs(study, "instruction")
    shown = {frozenset(pair) for pair in Matchup.objects.values_list("left", "right")}
    assert sorted(map(sorted, shown)) == sorted(sorted(pair[:2]) for pair in pairs)
    call_command("judge_study", study.name, endpoint="stand-in", model="fake-good")
    said = capsys.readouterr().out
    assert "6 of 6 pairs; preferences kept 6, lost 0, equal 0, unreadable 0" in said
    assert "Agrees with the experts on 100 %" in said
    after = rate_now(study=study, rounds=50, seed=1)
    assert Vote.objects.count() == votes
    assert [line.rating for line in after.standings.order_by("slug")] == [
        line.rating for line in before.standings.order_by("slug")
    ]
    assert after.votes_counted == before.votes_counted == votes
    name = "Judge fake-good at stand-in (simulated)"
    shares = {line.rater: line.share.value for line in after.results.agreement}
    assert shares[name] == 1.0
    assert name not in {line.rater for line in before.results.agreement}


def test_preferences_come_with_and_without_the_judges_own_family(
    study: Study, endpoint: Endpoint
) -> None:
    Contestant.objects.filter(slug="ann").update(
        kind="llm", variant="otm", endpoint=endpoint, model="fake-other"
    )
    call_command("judge_study", study.name, endpoint="stand-in", model="fake-good")
    found = judge_preferences(study, "instruction")
    name = "Judge fake-good at stand-in (simulated)"
    assert list(found) == [name, f"{name}, without its own family"]
    with_all, without = found.values()
    assert (len(with_all), len(without)) == (6, 2)
    codes = {str(row.code): row for row in Augmentation.objects.all()}
    for (left, right), preference in with_all.items():
        assert preference == (1 if codes[left].pk > codes[right].pk else -1)
    assert "ann" not in {codes[code].contestant.slug for pair in without for code in pair}
    shown = page(signed_in(people()["researcher"]), study)
    assert "without its own family: Ann" in shown


def test_a_run_that_was_cut_short_hides_no_answer_of_an_earlier_one(
    study: Study, endpoint: Endpoint
) -> None:
    call_command("judge_study", study.name, endpoint="stand-in", model="fake-good")
    old = PairJudgement.objects.earliest("pk")
    short = JudgeRun.objects.create(
        endpoint=endpoint, model="fake-good", state="cancelled", frames=4
    )
    same = {"left_image": "a.png", "right_image": "b.png", "first": "A", "second": "A"}
    row = PairJudgement.objects.create(
        run=short, left=old.right, right=old.left, state=PairJudgement.State.DONE, **same
    )
    study.judges.add(short)
    ((_, found),) = judge_preferences(study, "instruction").items()
    assert len(found) == 6
    assert found[str(row.left.code), str(row.right.code)] == 0
    JudgeRun.objects.filter(pk=short.pk).update(frames=0)  # another picture, another judge
    assert len(judge_preferences(study, "instruction").popitem()[1]) == 1


def test_a_contestant_uses_what_its_roles_ask_and_what_its_card_names() -> None:
    asking = Contestant(model="gpt-4o", roles={"viewer": {"endpoint": "e", "model": "gemini"}})
    sent = Contestant(kind="submission", card={"models": ["Llama 3.1"]})
    assert [list_models(row) for row in (asking, sent, Contestant())] == [
        *(["gpt-4o", "gemini"], ["Llama 3.1"], [])
    ]


@pytest.fixture
def labelled_job() -> GenerationJob:
    labelled_job = a_job()
    Scenario.objects.update(original_image=store(png(5)))
    return labelled_job


@pytest.fixture
def eva() -> User:
    return expert("eva")


@pytest.fixture
def labelling(labelled_job: GenerationJob, eva: User) -> LabellingRound:
    return open_labelling(name="Faults", job=labelled_job, experts=["eva"], seed=1)


def test_an_expert_labels_by_a_press_and_learns_the_guess_only_afterwards(
    labelling: LabellingRound, eva: User
) -> None:
    client, url = signed_in(eva), reverse("label", args=[labelling.code])
    page = client.get(url).content.decode()
    assert "automatic checks" not in page
    assert "Place a traffic cone" in page
    task = labelling.tasks.get(position=1)
    answer = client.post(url, {"task": task.code, "position": "on", "note": "far off"})
    assert answer.headers["Location"] == url
    label = FaultLabel.objects.get()
    assert (label.position, label.heading, label.logic, label.note) == (
        True,
        False,
        False,
        "far off",
    )
    assert "The automatic checks had guessed:" in client.get(url).content.decode()


def test_pictures_go_out_to_their_expert_alone(labelling: LabellingRound, eva: User) -> None:
    task, finn = labelling.tasks.get(position=1), expert("finn")
    for token in (task.token, task.original_token):
        url = reverse("matchup-image", args=[token])
        assert signed_in(eva).get(url).getvalue().startswith(b"\x89PNG")
        assert signed_in(finn).get(url).status_code == 404
    assert signed_in(finn).get(reverse("label", args=[labelling.code])).status_code == 404


def test_the_scene_before_stays_out_where_it_shows_another_window(
    labelling: LabellingRound, eva: User
) -> None:
    page, task = reverse("label", args=[labelling.code]), labelling.tasks.get(position=1)
    url = reverse("matchup-image", args=[task.original_token])
    assert task.original_token in signed_in(eva).get(page).content.decode()
    Scenario.objects.update(original_image=store(png(6), folder="bev/1-new"))
    assert task.original_token not in signed_in(eva).get(page).content.decode()
    assert signed_in(eva).get(url).status_code == 404
    Augmentation.objects.filter(pk=task.augmentation_id).update(
        image=store(png(7), folder="bev/1-new")
    )
    assert signed_in(eva).get(url).getvalue().startswith(b"\x89PNG")


def test_an_admin_opens_a_labelling_that_staff_read(
    labelled_job: GenerationJob, eva: User
) -> None:
    accounts, url = people(), reverse("faults", args=[labelled_job.code])
    sent = {"name": "Faults", "experts": ["eva"], "seed": "1"}
    assert signed_in(accounts["researcher"]).post(url, sent).status_code == 403
    admin = signed_in(accounts["admin"])
    assert admin.post(url, {**sent, "experts": []}).status_code == 422
    assert "is open" in admin.post(url, {**sent, "sure": "1"}, follow=True).content.decode()
    again = admin.post(url, sent)
    assert (again.status_code, "already" in again.content.decode()) == (422, True)
    labelling = LabellingRound.objects.get()
    signed_in(eva).post(
        reverse("label", args=[labelling.code]), {"task": labelling.tasks.all()[0].code}
    )
    shown = signed_in(accounts["researcher"]).get(url).content.decode()
    assert "Cohen’s kappa" in shown
    assert "1 of 2" in shown
    table = signed_in(accounts["researcher"]).get(
        reverse("job-export", args=[labelled_job.code, "faults", "csv"])
    )
    assert table.content.startswith(b"contestant,slug")
