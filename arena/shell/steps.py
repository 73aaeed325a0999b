"""The first steps of an installation, from nothing to a rated table, and which comes next."""

from dataclasses import dataclass

from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Study
from augment.models import Augmentation, Contestant, Endpoint, GenerationJob, Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One of the first steps: what is done there, and whether there is something of it.

    Attributes:
        name: What *Use the demo's* does; see `arena.site.demo`.
        url: Of the page where one's own is made, or waited for.
        act: The same as an order.
        found: So many there are.
    """

    name: str
    title: str
    text: str
    url: str
    act: str
    found: int


def first_steps() -> list[Step]:
    """Return the steps from an empty installation to a rated table."""
    is_there = [
        Endpoint.objects.count(),
        Scenario.objects.count(),
        Contestant.objects.exclude(endpoint=None).count(),
        Augmentation.objects.filter(state=Augmentation.State.DONE).count(),
        User.objects.filter(groups__name="expert").count(),
        Study.objects.filter(state=Study.State.CLOSED).count(),
    ]
    under_way = {
        "job": ("see the job end", GenerationJob.objects.filter(state="running").first()),
        "study": ("close the study", Study.objects.filter(state=Study.State.OPEN).first()),
    }
    steps = []
    for (name, page, title, text, act), found in zip(_STEPS, is_there, strict=True):
        waits, row = under_way.get(name, ("", None))
        steps.append(
            Step(
                name=name,
                title=title,
                text=text,
                url=reverse(name, args=[row.code]) if row else reverse(page),
                act=waits if row else act,
                found=found,
            )
        )
    return steps


def next_step() -> tuple[int, int, Step] | None:
    """Return how many steps are done, of how many, and the next; None once a study is closed."""
    if Study.objects.filter(state=Study.State.CLOSED).exists():
        return None
    steps = first_steps()
    left = [step for step in steps if not step.found]
    return len(steps) - len(left), len(steps), left[0]


_STEPS = (
    (
        *("models", "endpoint-new", "Language models"),
        *("Where they answer; the demo’s need no key.", "say where language models answer"),
    ),
    (
        *("scenarios", "scenes", "Scenarios"),
        *("Recorded scenes, each with a sentence to carry out.", "make scenarios"),
    ),
    (
        *("contestants", "contestant-new", "Contestants"),
        *("Models with a way of asking them.", "choose contestants"),
    ),
    ("job", "job-new", "A job", "Every contestant edits every scenario.", "launch a job"),
    (
        *("experts", "people", "Experts"),
        *("They compare the pictures blindly, two at a time.", "invite experts"),
    ),
    (
        *("study", "study-new", "A study"),
        *("Experts vote; closed, it ends at the table.", "open a study"),
    ),
)
"""Names, pages for one's own, titles, texts and orders."""
