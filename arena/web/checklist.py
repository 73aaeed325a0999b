"""What an admin does next, from an empty house to a rated table."""

from __future__ import annotations

from dataclasses import dataclass, replace

from django.utils.translation import gettext as _

from arena.queries.inventory import Inventory


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step on the way; the first that is not done is the next one.

    Attributes:
        link: The name of the page where it is done, empty where it is done by a command.
    """

    title: str
    detail: str
    done: bool
    link: str
    action: str
    is_next: bool = False


def steps(found: Inventory) -> list[Step]:
    """The way through the house, with what is done and what comes next."""
    return _with_next([*_preparing(found), *_studying(found)])


def _preparing(found: Inventory) -> list[Step]:
    return [
        Step(
            title=_("Load the catalogue"),
            detail=_("%(n)s scenarios are here.") % {"n": found.scenarios}
            if found.scenarios
            else _("No scenario yet. What comes with the project is loaded by a button."),
            done=found.scenarios > 0,
            link="scenarios",
            action=_("Scenarios"),
        ),
        Step(
            title=_("Have at least two contestants"),
            detail=_("%(n)s contestants are registered.") % {"n": found.contestants}
            if found.contestants
            else _("None yet. A model at an endpoint, or one of those that ask nobody."),
            done=found.contestants >= 2,
            link="contestants",
            action=_("Contestants"),
        ),
        Step(
            title=_("Run a job"),
            detail=_("%(n)s augmentations are done.") % {"n": found.done}
            if found.done
            else _("A job lets contestants carry out the instructions of scenarios."),
            done=found.done > 0,
            link="job-new",
            action=_("New job"),
        ),
    ]


def _studying(found: Inventory) -> list[Step]:
    return [
        Step(
            title=_("Open a study"),
            detail=_("%(n)s so far, %(open)s open now.")
            % {"n": found.studies, "open": found.studies_open}
            if found.studies
            else _("Experts compare two results of a scenario without knowing whose they are."),
            done=found.studies > 0,
            link="studies",
            action=_("Studies"),
        ),
        Step(
            title=_("Let the experts vote"),
            detail=_("%(n)s votes are saved; studies open: %(open)s.")
            % {"n": f"{found.votes:,}", "open": found.studies_open}
            if found.votes
            else _("No vote yet."),
            done=found.votes > 0 and found.studies_open == 0,
            link="studies",
            action=_("Progress"),
        ),
        Step(
            title=_("Close and read the results"),
            detail=_("%(n)s closed.") % {"n": found.studies_closed}
            if found.studies_closed
            else _("Results show once a study is closed."),
            done=found.studies_closed > 0,
            link="studies",
            action=_("Results"),
        ),
    ]


def _with_next(way: list[Step]) -> list[Step]:
    """The same steps, the first open one marked."""
    position = next((n for n, step in enumerate(way) if not step.done), None)
    return [replace(step, is_next=n == position) for n, step in enumerate(way)]
