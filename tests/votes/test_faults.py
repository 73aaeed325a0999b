"""Opening a labelling, labelling, and what comes out of it."""

import csv
import io
from collections import Counter

import pytest
from django.contrib.auth.models import User
from django.core.management import call_command
from django.db import IntegrityError, transaction

from arena.errors import LabellingClosed, NotYours
from arena.jobs.exports.faults import COUNTS, FORMATS, fault_table, tabulate_votes
from arena.jobs.queries import labelling_progress, next_task
from arena.jobs.services import close_labelling, open_labelling, save_label
from arena.models import FaultLabel, LabellingRound, LabelTask, Person, Study
from arena.studies.services.opening import close_study
from arena.voting.services.casting import FaultMark
from augment.errors import Conflict
from augment.models import Augmentation, Event, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.judging.findings import FaultClass
from tests.exports.test_displacement import a_job
from tests.scenes import vehicle
from tests.study_rows import a_study, expert, matchups_of, vote

pytestmark = pytest.mark.django_db

P, H, L = FaultClass.POSITION, FaultClass.HEADING, FaultClass.LOGIC


@pytest.fixture
def job() -> GenerationJob:
    """Ann has two augmentations with a modification; sim's two answers were unreadable."""
    return a_job()


@pytest.fixture
def eva() -> User:
    return expert("eva")


def opened(job: GenerationJob, *names: str, name: str = "Faults", seed: int = 1) -> LabellingRound:
    return open_labelling(name=name, job=job, experts=names, seed=seed)


def tasks_of(labelling: LabellingRound, user: User) -> list[LabelTask]:
    return list(labelling.tasks.filter(expert=user).order_by("position"))


def save(task: LabelTask, *faults: FaultClass, note: str = "") -> FaultLabel:
    return save_label(expert=task.expert, task_code=task.code, faults=frozenset(faults), note=note)


def test_every_expert_gets_every_finished_augmentation_once(job: GenerationJob, eva: User) -> None:
    expert("finn")
    labelling = opened(job, "eva", "finn")
    tasks = tasks_of(labelling, eva)
    assert [task.position for task in tasks] == [1, 2]
    assert {task.augmentation.contestant.slug for task in tasks} == {"ann"}
    tokens = [task.token for task in labelling.tasks.all()]
    tokens += [task.original_token for task in labelling.tasks.all()]
    assert len(set(tokens)) == 8
    with pytest.raises(Conflict, match="called 'Faults' already"):
        opened(job, "eva", seed=2)


def test_a_label_of_ones_own_keeps_faults_a_note_and_what_was_guessed(
    job: GenerationJob, eva: User
) -> None:
    first, second = tasks_of(opened(job, "eva"), eva)
    label = save(first, P, L, note=" in the kerb ")
    assert (label.position, label.heading, label.logic) == (True, False, True)
    assert label.note == "in the kerb"
    assert label.guessed_heading is False
    assert not save(second).position
    finn = expert("finn")
    with pytest.raises(NotYours):
        save_label(expert=finn, task_code=first.code, faults=frozenset())
    with pytest.raises(NotYours):
        labelling_progress(expert=finn, code=first.labelling.code)


def test_the_database_takes_a_label_each_and_a_whole_guess(job: GenerationJob, eva: User) -> None:
    first, second = tasks_of(opened(job, "eva"), eva)[:2]
    label = save(first)
    half = {"task": second, "augmentation": second.augmentation, "guessed_logic": None}
    for changes in (half, {"task": second}):
        again = FaultLabel.objects.get(pk=label.pk)
        for name, value in changes.items():
            setattr(again, name, value)
        again.pk, again._state.adding = None, True
        with pytest.raises(IntegrityError), transaction.atomic():
            again.save()


def test_of_several_experts_more_than_half_must_see_a_fault(job: GenerationJob, eva: User) -> None:
    finn = expert("finn")
    labelling = opened(job, "eva", "finn")
    by_eva, by_finn = tasks_of(labelling, eva), tasks_of(labelling, finn)
    by_finn.sort(key=lambda task: task.augmentation_id != by_eva[0].augmentation_id)
    save(by_eva[0], P, H)
    save(by_finn[0], P)
    save(by_eva[1], L)
    ann, sim = fault_table(job).lines
    assert [ann[name] for name in COUNTS] == [2, 1, 0, 1]
    assert [sim[name] for name in COUNTS] == [2, None, None, None], "nothing of it was labelled"
    assert (ann["labelled"], ann["labels"], sim["labelled"], sim["missed"]) == (2, 3, 0, 2)


def test_marks_on_ballots_of_closed_studies_are_labels_of_who_made_them() -> None:
    study = a_study(scenarios=2, votes_per_expert=3, questions=("instruction", "realism"))
    change = modification_to_document(Modification(added=(vehicle("car", 12.0, 1.0),)))
    Augmentation.objects.update(modification=change)
    Study.objects.update(ask_why=True)
    job = GenerationJob.objects.earliest("pk")
    Augmentation.objects.update(job=job)
    first, second, skipped = matchups_of(study, "eva")
    marks = [FaultMark("left", 0, P), FaultMark("left", 0, L)]
    vote(first, "equal", supersedes=vote(first, faults=[FaultMark("right", 0, H)]).key)
    vote(second, "right", faults=marks)
    answered = vote(skipped, faults=[FaultMark("left", 0, H)])
    vote(skipped, question="realism", faults=[FaultMark("left", 0, H)])
    vote(skipped, "skip", reason="unclear", supersedes=answered.key)
    Person.objects.filter(user__username="finn").update(is_simulated=True)
    for matchup in matchups_of(study, "finn"):
        vote(matchup)
    assert tabulate_votes(job).labels == 0, "the study is open"
    close_study(study=study)
    table = tabulate_votes(job)
    seen = {second.left.contestant.slug: [2, 1, 0, 1]}
    judged = Counter(
        row.contestant.slug for row in {first.left, first.right, second.left, second.right}
    )
    for line in table.lines:
        nothing = [0, 0, 0, 0] if judged[line["slug"]] else [None] * 4
        assert [line[name] for name in COUNTS] == seen.get(line["slug"], nothing)
        assert line["labelled"] == judged[line["slug"]]
    assert [line["n"] for line in table.agreement] == [1, 1, 1]
    out = io.StringIO()
    options = ("--from", "votes", "--format", "latex", "--out", "-")
    call_command("export", "faults", str(job.code), *options, stdout=out)
    assert out.getvalue() == FORMATS["latex"].write(table).decode()
    assert "lower bounds" in out.getvalue()


def test_a_closed_labelling_takes_and_asks_for_nothing(job: GenerationJob, eva: User) -> None:
    labelling = opened(job, "eva")
    first, second = tasks_of(labelling, eva)
    label = save(first, P)
    close_labelling(labelling=labelling)
    with pytest.raises(LabellingClosed):
        save(second)
    assert save(first, P) == label, "a replay of what was saved in time is no new label"
    assert next_task(labelling=labelling, expert=eva) is None
    assert labelling_progress(expert=eva, code=labelling.code).left == 0
    with pytest.raises(LabellingClosed):
        close_labelling(labelling=labelling)
    event = Event.objects.get(verb="close", object_kind="labelling")
    assert event.after == {"labels": 1}


def test_the_files_have_the_papers_columns(job: GenerationJob, eva: User) -> None:
    save(tasks_of(opened(job, "eva"), eva)[0], P)
    table = fault_table(job)
    lines = list(csv.DictReader(io.StringIO(FORMATS["csv"].write(table).decode())))
    assert [(line["contestant"], line["all"]) for line in lines] == [
        ("ann", "1"),
        ("sim (simulated)", "2"),
    ]
    text = FORMATS["latex"].write(table).decode()
    assert r"    ann & 1 & 1 & 0 & 0 & 0 & 1\\" in text
    # Two unreadable answers and nothing to label: two misses, of two.
    assert r"    sim (simulated) & 2 & -- & -- & -- & 2 & 2\\" in text
    out = io.StringIO()
    call_command("export", "faults", "Round 1", "--format", "latex", "--out", "-", stdout=out)
    assert out.getvalue() == text
