"""The pages that people can open, with rows behind them: for what has to hold on all of them."""

from dataclasses import dataclass

from django.contrib.auth.models import User
from django.urls import reverse

from arena.results.exports.board_files import write_table
from arena.results.pages.tabs import TABS
from arena.results.queries.votes import Filters
from arena.results.services.boards import make_board, publish_table
from arena.results.services.ratings import rate_now as rate
from augment.models import GenerationJob, Submission
from tests.drives import driven
from tests.mixed_study import mixed_study
from tests.web.addresses import address
from tests.web.cast import people, signed_in, world
from tests.web.test_access import PAGES


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownPage:
    """A page as somebody is shown it."""

    name: str
    url: str
    user: User
    html: str


def pages_of_an_open_study() -> list[ShownPage]:
    """The pages that an admin can open, one of the questions, those of an expert who votes."""
    here, admin = world(), people()["admin"]
    named = {name: address(name, here) for name in (*PAGES, "study-close")}
    staff = _shown(admin, named)
    own = {name: url for name, url in named.items() if name.startswith(("home", "vote"))}
    sender = Submission.objects.get().uploaded_by
    assert sender is not None
    entered = [name for name in named if name.startswith(("home", "submission", "benchmark"))]
    theirs = _shown(sender, {name: named[name] for name in entered})
    return staff + _shown(here.expert, own) + theirs


def pages_of_a_rated_study() -> list[ShownPage]:
    """The results of a study with everything that a vote can be, closed and rated."""
    study = mixed_study()
    study.allow_simulated = True
    study.save()
    rate(study=study, rounds=100, filters=Filters())
    code, job = [study.code], GenerationJob.objects.earliest("pk")
    driven(job)
    named = {f"tab {tab}": reverse("results-tab", args=[*code, tab]) for tab in TABS}
    named |= {
        name: reverse(name, args=code)
        for name in ("study", "preregistration", "results-votes", "results-judges")
    }
    named["job driving"] = reverse("job-tab", args=[job.code, "driving"])
    board = make_board(name="City", study=study)
    publish_table(board, write=write_table)
    named["board"] = reverse("board", args=[board.code])
    return _shown(people()["admin"], named)


def _shown(user: User, named: dict[str, str]) -> list[ShownPage]:
    client, found = signed_in(user), []
    for name, url in named.items():
        answer = client.get(url)
        is_page = "html" in answer.headers.get("Content-Type", "")
        if answer.streaming:
            b"".join(answer)
        elif answer.status_code == 200 and is_page:
            html = answer.content.decode()
            found.append(ShownPage(name=name, url=url, user=user, html=html))
    return found
