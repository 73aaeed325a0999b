"""The log of administrative acts, and every door through which results could be seen early."""

from io import StringIO
from pathlib import Path

import pytest
from django.core.management import CommandError, call_command
from django.test import Client
from django.urls import reverse

from arena.models import EarlyLook, Snapshot, Study
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Event
from tests import study_rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def _page(client: Client, **asked: str) -> str:
    return client.get(reverse("audit"), asked).content.decode()


def _acts() -> tuple[Client, Study]:
    """An opening by the machine, a closing by an admin, and something done to a scene."""
    accounts = people()
    study = close_study(study=study_rows.a_study(), actor=accounts["admin"])
    Event.objects.create(
        actor=accounts["researcher"],
        verb="import",
        object_kind="scene",
        object_code="a-street",
        after={"notes": "=1+1"},
    )
    return signed_in(accounts["admin"]), study


def test_acts_are_filtered() -> None:
    client, study = _acts()
    admin = Event.objects.get(verb="close").actor
    assert admin is not None
    everything = _page(client)
    assert all(word in everything for word in ("a-street", str(study.code), "the machine"))
    rows = {
        "actor": (str(admin.person.code), "closed"),
        "verb": ("close", "closed"),
        "object_kind": ("scene", "notes: =1+1"),
        "q": (str(study.code)[:13], str(study.code)),
    }
    for name, (value, shown) in rows.items():
        body = _page(client, **{name: value}).partition("<tbody>")[2]
        assert shown in body, name
        assert ("a-street" in body) == (name == "object_kind"), name


# --- Early looks -------------------------------------------------------------------------------

TABS = ("table", "pairs", "types", "raters", "displacement", "cost", "log")
GATED = ("results", *TABS)
"""What answers with the question whether to look early."""


def _pages(study: Study, rating: Snapshot) -> dict[str, str]:
    """Every address that tells of the results of a study."""
    code = study.code
    return {
        "results": reverse("results", args=[code]),
        **{tab: reverse("results-tab", args=[code, tab]) for tab in TABS},
        "votes": reverse("results-votes", args=[code]),
        **{
            f"{name}.{form}": reverse("results-export", args=[code, name, form])
            for name, form in (
                *(("leaderboard", form) for form in ("csv", "json", "latex", "parquet")),
                *(("all", "zip"), ("votes", "csv"), ("pairs", "svg")),
            )
        },
        "api rating": reverse("api-snapshot", args=[rating.code]),
        "api file": reverse("api-snapshot-file", args=[rating.code, "leaderboard", "csv"]),
    }


def _rated_while_open() -> tuple[Study, dict[str, str]]:
    study = study_rows.a_study()
    for number, one in enumerate(study.matchups.order_by("pk")):
        study_rows.vote(one, ("left", "equal", "right")[number % 3])
    snapshot = rate(study=study, early=True)
    return study, _pages(study, snapshot)


def test_no_page_shows_results_of_an_open_study_before_an_early_look() -> None:
    study, pages = _rated_while_open()
    accounts = people()
    for role in ("admin", "researcher"):
        client = signed_in(accounts[role])
        for name, address in pages.items():
            answer = client.get(address)
            shown = answer.content.decode(errors="replace")
            if answer.status_code == 200:  # the gate, which asks whether to look early
                assert name in GATED, (role, name)
                assert 'class="standings"' not in shown, (role, name)
            else:
                assert answer.status_code in (403, 409), (role, name)
    assert not EarlyLook.objects.exists()
    researcher = signed_in(accounts["researcher"])
    researcher.post(reverse("results-open", args=[study.code]))
    look = Event.objects.get(verb="look early")
    assert (look.actor, look.object_code) == (accounts["researcher"], str(study.code))
    assert {name: researcher.get(address).status_code for name, address in pages.items()} == (
        dict.fromkeys(pages, 200)
    )
    admin = signed_in(accounts["admin"])
    assert admin.get(pages["leaderboard.csv"]).status_code == 403


@pytest.mark.parametrize(
    ("command", "what"),
    [
        (("rate", "Round 1"), "rating, printed"),
        (("export", "leaderboard", "Round 1"), "leaderboard as csv"),
        (("export", "votes", "Round 1"), "votes as csv"),
    ],
)
def test_a_command_shows_them_only_on_purpose_and_that_is_logged(
    command: tuple[str, ...], what: str, tmp_path: Path
) -> None:
    _rated_while_open()
    more = () if command[0] == "rate" else ("--out", str(tmp_path / "file.csv"))
    with pytest.raises(CommandError):
        call_command(*command, *more, stdout=StringIO())
    assert not Event.objects.filter(verb="look early").exists()
    call_command(*command, *more, "--early", stdout=StringIO())
    assert Event.objects.get(verb="look early").after == {"what": what}
