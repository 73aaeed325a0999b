"""What an admin does next, from an empty house to a rated table."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
            title="Load the catalogue",
            detail=f"{found.scenarios} scenarios are here."
            if found.scenarios
            else "No scenario yet. What comes with the project is loaded by a button.",
            done=found.scenarios > 0,
            link="scenarios",
            action="Scenarios",
        ),
        Step(
            title="Have at least two contestants",
            detail=f"{found.contestants} contestants are registered."
            if found.contestants
            else "None yet. A model at an endpoint, or one of those that ask nobody.",
            done=found.contestants >= 2,
            link="contestants",
            action="Contestants",
        ),
        Step(
            title="Run a job",
            detail=f"{found.done} augmentations are done."
            if found.done
            else "A job lets contestants carry out the instructions of scenarios.",
            done=found.done > 0,
            link="job-new",
            action="New job",
        ),
    ]


def _studying(found: Inventory) -> list[Step]:
    return [
        Step(
            title="Open a study",
            detail=f"{found.studies} so far, {found.studies_open} open now."
            if found.studies
            else "Experts compare two results of a scenario without knowing whose they are.",
            done=found.studies > 0,
            link="studies",
            action="Studies",
        ),
        Step(
            title="Let the experts vote",
            detail=f"{found.votes:,} votes are saved; studies open: {found.studies_open}."
            if found.votes
            else "No vote yet.",
            done=found.votes > 0 and found.studies_open == 0,
            link="studies",
            action="Progress",
        ),
        Step(
            title="Close and read the results",
            detail=f"{found.studies_closed} closed."
            if found.studies_closed
            else "Results show once a study is closed.",
            done=found.studies_closed > 0,
            link="studies",
            action="Results",
        ),
    ]


def _with_next(way: list[Step]) -> list[Step]:
    """The same steps, the first open one marked."""
    position = next((n for n, step in enumerate(way) if not step.done), None)
    return [replace(step, is_next=n == position) for n, step in enumerate(way)]
