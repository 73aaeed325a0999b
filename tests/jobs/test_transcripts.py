"""The record of an augmentation, as one document that says everything."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from django.core.management import call_command
from django.test import Client
from django.urls import reverse

from augment.llm.messages import request_hash
from augment.models import Attempt, Augmentation, Endpoint, ModelCall, TranscriptNote
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest
from augment.services.running.progress import tool_calls
from augment.services.running.transcript_records import full_transcript, list_tries, sum_totals
from augment.variants.respondents import NoteKind
from tests.jobs.models import Model, after_a_second_look, llama_job, ran, reply
from tests.jobs.rows import INSTRUCTION, NOON, launch, only_row
from tests.llm.json_server import GOOD as HEARD
from tests.llm.raw_server import speaking, whole
from tests.variants.playing import GOOD
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_the_document_holds_the_whole_record_and_is_a_line_of_a_jobs_file(tmp_path: Path) -> None:
    row = ran(only_row(llama_job(price="2")), Model(after_a_second_look))
    document = json.loads(json.dumps(full_transcript(row)))
    assert (document["format"], document["version"]) == ("scenario-arena/transcript", 3)
    assert document["augmentation"]["state"] == "done"
    assert document["augmentation"]["modification"] == row.modification
    assert "seed" not in document["augmentation"]
    assert INSTRUCTION in document["scenario"]["instruction"]
    assert document["contestant"]["model"] == "llama3.1"
    assert document["contestant"]["endpoint"]["base_url"] == "http://127.0.0.1:9/v1"
    (attempt,) = document["attempts"]
    first, second = attempt["steps"]
    assert (attempt["outcome"], attempt["worker"]) == ("done", "w")
    assert (first["answer"], second["answer"]) == ("Sorry?", GOOD)
    assert (first["number"], first["role"], first["kind"]) == (1, "modifier", "call")
    assert (first["prompt_tokens"], first["completion_tokens"]) == (2900, 120)
    assert (first["cost_usd"], first["is_cost_estimated"]) == ("0.00604", False)
    assert (first["model_returned"], first["latency_s"]) == ("llama3.1-2407", 0.1)
    assert first["prompt_version"]
    assert len(first["request_hash"]) == 64
    assert first["request"]["messages"][-1]["role"] == "user"
    assert document["totals"] == {
        "calls": 2,
        "calls_from_store": 0,
        "prompt_tokens": 5800,
        "completion_tokens": 240,
        "spent_tokens": 6040,
        "cost_usd": "0.01208",
        "is_cost_estimated": False,
    }
    out = tmp_path / "all.jsonl"
    call_command("export", "transcripts", row.job.name, "--out", str(out))
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    assert lines == [document | {"images": sorted(document["images"])}]


def test_a_request_in_it_is_what_the_server_was_sent_and_nothing_else() -> None:
    row = only_row(llama_job())
    with speaking(whole(json.dumps(HEARD).encode())) as server:
        Endpoint.objects.update(base_url=server.url)
        runner.AUGMENTATIONS.perform(row.pk)
    document = json.loads(json.dumps(full_transcript(row)))
    calls = [step for step in document["attempts"][0]["steps"] if step["kind"] == "call"]
    sent = [json.loads(heard.partition(b"\r\n\r\n")[2]) for heard in server.heard]
    assert [call["request"] for call in calls] == sent
    assert sorted(sent[0]) == ["max_completion_tokens", "messages", "model"]
    page = signed_in(people()["admin"]).get(reverse("augmentation", args=[row.code]))
    for name in ("seed", "temperature"):
        assert f"<dt>{name}</dt>" not in page.content.decode().lower()
    assert '"seed"' not in json.dumps(document)
    assert '"temperature"' not in json.dumps(document)


def test_a_call_from_the_store_names_its_source() -> None:
    job = llama_job(price="1", caps=Caps(cap_calls=1))
    model = Model(after_a_second_look)
    row = ran(only_row(job), model)
    jobs.resume(job, higher=Caps(cap_calls=2))
    document = full_transcript(ran(row, model))
    paid = document["attempts"][0]["steps"][0]
    copied, last = document["attempts"][1]["steps"]
    assert (copied["served_from"], copied["cost_usd"]) == (paid["code"], "0")
    assert (paid["served_from"], last["served_from"]) == (None, None)
    totals = sum_totals(list_tries(row))
    assert (totals.calls, totals.calls_from_store, totals.spent_tokens) == (2, 1, 6040)


def test_the_order_in_which_a_database_keeps_keys_does_not_show() -> None:
    """PostgreSQL keeps the keys of a stored document in an order of its own."""

    def backwards(document: Any) -> Any:
        if isinstance(document, dict):
            return {name: backwards(document[name]) for name in reversed(document)}
        return [backwards(one) for one in document] if isinstance(document, list) else document

    row = ran(only_row(llama_job()), Model())
    call = ModelCall.objects.get()
    note = TranscriptNote.objects.create(
        attempt=call.attempt,
        number=1,
        after_call=1,
        kind=NoteKind.KEPT,
        document={"round": 1, "accepted": None, "remark": ""},
    )
    before = json.dumps(full_transcript(row))
    call.request, note.document = backwards(call.request), backwards(note.document)
    call.save()
    note.save()
    row.modification = backwards(row.modification)
    row.save()
    assert json.dumps(full_transcript(Augmentation.objects.get(pk=row.pk))) == before
    known = request_hash(
        base_url="http://127.0.0.1:9/v1",
        document=ModelCall.objects.get().request,
        prompt_version=call.prompt_version,
    )
    assert known == call.request_hash


def note_calls(row: Augmentation, attempt: int, *calls: tuple[bool, bool]) -> None:
    made = Attempt.objects.create(augmentation=row, number=attempt, started_at=NOON)
    for number, (understood, mended) in enumerate(calls, start=1):
        document = {"understood": understood, "mended": mended, "result": {}}
        TranscriptNote.objects.create(
            attempt=made, number=number, after_call=1, kind="tool_call", document=document
        )


@pytest.mark.django_db(transaction=True)
def test_calls_are_counted_per_contestant_everywhere(capsys: pytest.CaptureFixture[str]) -> None:
    job = launch(scenarios=2, contestants=("one", "other"))
    first, second = Augmentation.objects.filter(contestant__slug="one").order_by("scenario__slug")
    note_calls(first, 1, (False, False), (False, False))  # broke, and was tried again
    note_calls(first, 2, (True, False), (True, True), (False, False))
    note_calls(second, 1, (True, False))
    lines = [(line["attempted"], line["understood"], line["mended"]) for line in tool_calls(job)]
    assert lines == [(3, 2, 1), (1, 1, 0)]

    Augmentation.objects.update(state=Augmentation.State.FAILED)
    page = signed_in(people()["researcher"]).get(f"/jobs/{job.code}/files/").content.decode()
    assert "/files/tool-calls.csv" in page

    call_command("export", "tool-calls", str(job.code), out="-")
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [(row["scenario"], row["attempted"], row["mended"]) for row in rows] == [
        ("street-1", "3", "1"),
        ("street-2", "1", "0"),
    ]


EVIL = "<script>alert(1)</script>"


def page_of(row: Augmentation, reader: Client | None = None) -> str:
    reader = reader or signed_in(people()["researcher"])
    answer = reader.get(reverse("augmentation", args=[row.code]))
    assert answer.status_code == 200
    return answer.content.decode()


def test_pages_show_role_tokens_cost_and_answer_and_lead_from_a_copy_to_its_source() -> None:
    reader, first = signed_in(people()["researcher"]), ran(llama_job(price="2"), Model())
    shown = page_of(first, reader)
    for part in ("Call 1, modifier", "2,900 tokens in, 120 out", "$0.0060", "A parked car ahead."):
        assert part in shown
    assert "llama3.1-2407" in shown
    assert "Prompt version" in shown
    job = jobs.launch(JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"]))
    shown = page_of(ran(job, Model()), reader)
    assert "answered from the store" in shown
    assert f"{reverse('augmentation', args=[first.code])}#call-1-1" in shown


def test_what_a_model_says_is_never_markup() -> None:
    shown = page_of(ran(only_row(llama_job()), Model(lambda request: reply(EVIL))))
    assert EVIL not in shown
    assert "&lt;script&gt;alert(1)" in shown


def test_no_other_file_is_given_out() -> None:
    admin = signed_in(people()["admin"])
    for digest in ("0" * 64, "0" * 63, "A" * 64, "secret_key"):
        assert admin.get(reverse("asked-image", args=[digest])).status_code == 404
