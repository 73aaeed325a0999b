"""The drives on the voting page: where a study plays them, and no trace where it does not."""

import re

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Study
from augment.models import Augmentation
from tests.drives import drive_pictures
from tests.opening import open_study
from tests.study_rows import Cast, a_study, cast_of, matchups_of
from tests.web.cast import signed_in

pytestmark = pytest.mark.django_db


def a_driven_cast(**cast: object) -> Cast:
    made = cast_of(**cast)  # type: ignore[arg-type]
    drive_pictures(Augmentation.objects.select_related("contestant", "scenario"))
    return made


def a_replayed_study(**cast: object) -> Study:
    made = a_driven_cast(**cast)
    return open_study(name="Round 1", votes_per_expert=9, seed=7, allow_replay=True, **made)


def page(study: Study) -> str:
    return reverse("vote", args=[study.code])


def loaded(shown: str) -> set[str]:
    return set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))


def test_a_study_without_them_has_no_trace_of_them() -> None:
    study = a_study()
    eva = signed_in(User.objects.get(username="eva"))
    for address in (page(study), f"{page(study)}help/"):
        shown = eva.get(address).content.decode()
        for trace in ("replay", "film.css", "Drives", "planner", "<kbd>D</kbd>"):
            assert trace not in shown, (address, trace)


def test_the_answer_says_nothing_of_where_it_comes_from() -> None:
    first = matchups_of(a_replayed_study(), "eva")[0]
    address = reverse("replay", args=[first.code])
    answer = signed_in(User.objects.get(username="eva")).get(address)
    assert set(answer.json()) == {"a", "b"}
    assert set(answer.json()["a"]) == {
        "format",
        "version",
        "step_s",
        "steps",
        "ego",
        "road",
        "objects",
    }
    assert answer["Cache-Control"] == "private, no-store"
    assert not {"ETag", "Last-Modified", "Content-Disposition"} & set(answer.headers)
    assert signed_in(User.objects.get(username="finn")).get(address).status_code == 404
