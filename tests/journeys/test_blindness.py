"""An expert who follows every link and tries every address learns nothing of the contestants."""

from __future__ import annotations

import re
from html import unescape
from urllib.parse import urldefrag, urljoin, urlsplit

import pytest
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.test import Client
from django.urls import URLPattern, URLResolver, get_resolver

from arena.models import LabellingRound, Study
from arena.services.faults import open_labelling
from augment.models import Augmentation, Contestant, Endpoint, GenerationJob
from tests.study_rows import a_study

pytestmark = pytest.mark.django_db

SECRETS = ("zanzibar", "xylophone", "quixotic")
LINK = re.compile(rb"""(?:href|src|action|srcset)=["']([^"'#][^"']*)["']""")


@pytest.fixture
def study() -> Study:
    """An open study whose contestants have telling names, models and variants."""
    study = a_study(contestants=SECRETS)
    endpoint = Endpoint.objects.create(label="hosted-llama", base_url="https://llama.example/v1")
    Contestant.objects.filter(slug="zanzibar").update(
        name="Zanzibar OTM",
        kind=Contestant.Kind.LLM,
        variant="otm",
        model="llama-3.1-70b",
        endpoint=endpoint,
    )
    for row in Augmentation.objects.all():
        default_storage.save(row.image, ContentFile(b"\x89PNG\r\n\x1a\n" + row.image.encode()))
    job = GenerationJob.objects.filter(augmentations__contestant__slug="zanzibar").first()
    assert job is not None
    open_labelling(name="Faults", job=job, experts=["eva"], seed=1)
    return study


@pytest.fixture
def eva(client: Client, study: Study) -> Client:
    client.force_login(User.objects.get(username="eva"))
    return client


def secrets_of(study: Study) -> list[str]:
    """Everything that tells who made a picture."""
    told = [*SECRETS, "llama", "otm", "hosted"]
    told += [str(contestant.code) for contestant in study.contestants.all()]
    for row in Augmentation.objects.select_related("job"):
        told += [str(row.code), str(row.job.code), row.image]
    return told


def crawl(client: Client, starts: list[str]) -> dict[str, tuple[int, bytes, str]]:
    """Every address that can be reached by links from the starts: status, body, headers."""
    seen: dict[str, tuple[int, bytes, str]] = {}
    waiting = list(starts)
    while waiting:
        address = waiting.pop()
        if address in seen or address.startswith(("/logout", "/static/")):
            continue
        response = client.get(address)
        body = b"".join(response) if response.streaming else response.content
        headers = "\n".join(f"{name}: {value}" for name, value in response.items())
        seen[address] = (response.status_code, body, headers)
        found = [unescape(link.decode()) for link in LINK.findall(body)]
        if response.status_code in {301, 302}:
            found.append(response["Location"])
        for link in found:
            target = urldefrag(urljoin(address, link)).url
            if not urlsplit(target).netloc:
                waiting.append(target)
    return seen


def every_address(study: Study) -> list[str]:
    """Every address of the product, filled with codes and tokens that exist."""
    row = Augmentation.objects.first()
    assert row is not None
    matchup = study.matchups.first()
    assert matchup is not None
    values = {
        "study": study.code,
        "job": row.job.code,
        "augmentation": row.code,
        "scenario": row.scenario.code,
        "contestant": row.contestant.code,
        "labelling": LabellingRound.objects.get().code,
    }
    found = []
    for pattern in patterns(get_resolver().url_patterns):
        if pattern.startswith("admin/"):
            continue
        for code in values.values():
            filled = re.sub(r"<uuid:\w+>", str(code), pattern)
            filled = re.sub(r"<str:token>", matchup.left_token, filled)
            filled = re.sub(r"<slug:form>", "csv", filled)
            filled = re.sub(r"<slug:kind>", "augmentation", filled)
            found.append("/" + filled)
    return [*sorted(set(found)), "/admin/", "/admin/augment/contestant/"]


def patterns(entries: list[URLPattern | URLResolver], before: str = "") -> list[str]:
    found = []
    for entry in entries:
        here = before + str(entry.pattern)
        found += patterns(entry.url_patterns, here) if isinstance(entry, URLResolver) else [here]
    return found


def leaks(
    study: Study, seen: dict[str, tuple[int, bytes, str]], *, guessed: bool = False
) -> list[str]:
    """What was told. A guessed address is the guesser's own: that it comes back tells nothing."""
    found = []
    for address, (_, body, headers) in seen.items():
        if address.startswith("/i/"):  # our stand-in pictures hold their own name
            continue
        told = (body + headers.encode() + (b"" if guessed else address.encode())).lower()
        for secret in secrets_of(study):
            word = rb"(?<![a-z0-9])" + re.escape(secret.lower().encode()) + rb"(?![a-z0-9])"
            if re.search(word, told) and not (guessed and secret in address):
                found.append(f"{address} tells {secret!r}")
    return found


def test_following_every_link_tells_nothing(eva: Client, study: Study) -> None:
    seen = crawl(eva, ["/", f"/api/v1/matchups?study={study.code}&n=4"])
    assert any(address.startswith("/i/") for address in seen), "the crawl saw no picture"
    assert any("/vote/" in address for address in seen), "the crawl saw no voting page"
    assert any("/label/" in address for address in seen), "the crawl saw no labelling page"
    assert leaks(study, seen) == []


def test_trying_every_address_tells_nothing(eva: Client, study: Study) -> None:
    addresses = [address for address in every_address(study) if not address.startswith("/i/")]
    assert leaks(study, crawl(eva, addresses), guessed=True) == []


def test_the_results_of_an_open_study_are_closed_to_its_experts(eva: Client, study: Study) -> None:
    assert eva.get(f"/studies/{study.code}/results/").status_code in {403, 404}
    assert eva.get(f"/studies/{study.code}/results.csv").status_code in {403, 404}


def test_a_picture_comes_without_traces_and_only_to_its_expert(eva: Client, study: Study) -> None:
    mine = study.matchups.filter(expert__username="eva").first()
    hers = study.matchups.filter(expert__username="finn").first()
    assert mine is not None
    assert hers is not None
    answer = eva.get(f"/i/{mine.left_token}")
    assert answer.getvalue().startswith(b"\x89PNG")
    assert answer.status_code == 200
    assert {"ETag", "Last-Modified"} & set(answer.headers) == set()
    assert answer.headers.get("Content-Disposition", "inline") == "inline"
    assert {"private", "immutable"} <= set(
        answer.headers["Cache-Control"].replace(",", "").split()
    )
    assert eva.get(f"/i/{hers.left_token}").status_code == 404
    assert eva.get("/i/not-a-token").status_code == 404


def test_nobody_else_sees_anything_but_the_login(client: Client, study: Study) -> None:
    for address in every_address(study):
        answer = client.get(address)
        assert answer.status_code in {302, 401, 403, 404, 405} or address == "/login/", address
        if answer.status_code == 302:
            assert urlsplit(answer["Location"]).path in {"/login/", "/admin/login/"}, address


def test_a_planted_leak_is_found(eva: Client, study: Study) -> None:
    study.name = "Zanzibar against the rest"
    study.save()
    assert leaks(study, crawl(eva, ["/"])) != []


def test_the_page_after_a_label_tells_nothing_either(eva: Client, study: Study) -> None:
    labelling = LabellingRound.objects.get()
    page = f"/label/{labelling.code}/"
    eva.post(page, {"task": labelling.tasks.all()[0].code, "position": "on"})
    seen = crawl(eva, [page])
    assert b"The automatic checks" in seen[page][1]
    assert leaks(study, seen) == []
