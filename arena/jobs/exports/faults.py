"""Fault labels of a job in the form of the paper's table, and how well the checks foresaw them."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

import numpy as np
from django.db.models import Count, Q

from arena.exports.cells import show_name
from arena.exports.formats import Columns, Dtype, Sheet, formats, make_sheet, table_formats
from arena.exports.latex import ValueColumns, latex_values
from arena.jobs.services import guessed_columns
from arena.models import FaultLabel, Matchup, Study, Vote
from arena.rating.reliability import DifferenceMetric, cohens_kappa, krippendorff_alpha
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.judging import FaultClass

MARKED = "Marked on ballots, where nobody has to mark: lower bounds; n is what was judged."
_LABEL = (
    *("augmentation", "position", "heading", "logic", "augmentation__contestant"),
    *("guessed_position", "guessed_heading", "guessed_logic"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTable:
    """The faults of a job.

    Attributes:
        lines: A dict a contestant, by name. `position`, `heading` and `logic` are augmentations
            with that fault, one with two counts in both; `all` is their sum, as the paper has it,
            and one for each unreadable or refused answer (`missed`), which nobody labels. They
            are None where nothing was labelled. `labels` are those on the augmentations
            `labelled`, over all experts; `counted` are judged: labelled or missed.
        agreement: A dict a class of faults. `kappa` is Cohen's, of the checks' first guess and the
            experts over `n` labels; `alpha` is Krippendorff's, nominal, of the experts among
            themselves over the `pictures` that two or more have labelled. None is undefined.
        note: How to read it, empty for labels by hand.
    """

    job: str
    lines: list[dict[str, Any]]
    agreement: list[dict[str, Any]]
    note: str = ""

    @property
    def labels(self) -> int:
        """Over all contestants."""
        return sum(line["labels"] for line in self.lines)

    @property
    def counted(self) -> int:
        """Augmentations that are judged, over all contestants."""
        return sum(line["counted"] for line in self.lines)


def fault_table(job: GenerationJob) -> FaultTable:
    """Return the table of labels by hand; two queries, a row a label and a contestant.

    Of several experts on one augmentation a fault counts where more than half of them see it.
    """
    rows = FaultLabel.objects.filter(augmentation__job=job).select_related("augmentation")
    return _tabulate(job, list(rows.only(*_LABEL).order_by("augmentation", "pk")))


def tabulate_votes(job: GenerationJob) -> FaultTable:
    """Return the table of what experts marked on ballots of closed studies that ask what is wrong.

    Nobody has to mark anything, so only who marked an augmentation has a label on it, and its
    counts are lower bounds. `labelled` are all that were judged, marked or not.
    """
    asks = Q(matchup__study__ask_why=True, matchup__study__state=Study.State.CLOSED)
    current = Vote.objects.filter(asks, superseded_by=None, is_simulated=False)
    skips = current.filter(outcome=Vote.Outcome.SKIP)  # of pairs, whatever else was answered
    votes = current.filter(matchup__kind=Matchup.Kind.MAIN).order_by("pk")
    votes = votes.exclude(matchup__in=skips.values("matchup"))
    judged: dict[int, Augmentation] = {}
    marks: defaultdict[tuple[int, int], set[str]] = defaultdict(set)
    for side in ("left", "right"):
        own = votes.filter(**{f"shown_{side}__job": job, f"shown_{side}__state": "done"})
        for vote in own.select_related(f"shown_{side}"):
            row = getattr(vote, f"shown_{side}")
            judged[row.pk] = row
            if classes := {fault for marked, _, fault in vote.faults if marked == side}:
                marks[row.pk, vote.expert_id] |= classes
    guesses = {pk: guessed_columns(judged[pk]) for pk, _ in marks}
    labels = [
        FaultLabel(
            augmentation=judged[pk],
            expert_id=expert,
            **{fault.value: fault in classes for fault in FaultClass},
            **guesses[pk],
        )
        for (pk, expert), classes in sorted(marks.items())
    ]
    counts = Counter(row.contestant_id for row in judged.values())
    return replace(_tabulate(job, labels, counts), note=MARKED)


def _tabulate(
    job: GenerationJob, labels: list[FaultLabel], judged: Mapping[int, int] | None = None
) -> FaultTable:
    """Make the table of labels, in the order of their augmentations.

    Args:
        job: Whose augmentations they are on.
        labels: At least one on each augmentation that was labelled.
        judged: How many augmentations of each contestant were judged; None for those with labels.
    """
    by_augmentation: defaultdict[int, list[FaultLabel]] = defaultdict(list)
    for label in labels:
        by_augmentation[label.augmentation_id].append(label)
    by_contestant: defaultdict[int, list[list[FaultLabel]]] = defaultdict(list)
    for own in by_augmentation.values():
        by_contestant[own[0].augmentation.contestant_id].append(own)
    mine = Q(augmentations__job=job)
    misses = Count("augmentations", filter=mine & Q(augmentations__state__in=Augmentation.MISSES))
    contestants = Contestant.objects.filter(mine).annotate(missed=misses)
    lines = []
    for who in contestants.only("name", "slug", "kind").order_by("name", "slug"):
        labelled, missed = by_contestant[who.pk], who.missed
        number = len(labelled) if judged is None else judged.get(who.pk, 0)
        seen = {fault.value: sum(_is_seen(fault, own) for own in labelled) for fault in FaultClass}
        counted = number + missed
        line = {
            "name": who.name,
            "shown_name": show_name(who),
            "slug": who.slug,
            "is_simulated": who.is_simulated,
            "all": sum(seen.values()) + missed if counted else None,
            **(seen if number else dict.fromkeys(seen)),
            "labelled": number,
            "labels": sum(map(len, labelled)),
            "missed": missed,
            "counted": counted,
        }
        lines.append(line)
    agreement = [_agreement(fault, labels, by_augmentation.values()) for fault in FaultClass]
    return FaultTable(job=job.name, lines=lines, agreement=agreement)


COUNTS = ("all", "position", "heading", "logic")
COLUMNS: Columns = {
    "contestant": ("shown_name", Dtype.TEXT),
    **Dtype.TEXT.columns("slug"),
    "simulated": ("is_simulated", Dtype.YES_NO),
    **Dtype.WHOLE.columns(*COUNTS),
    "augmentations_labelled": ("labelled", Dtype.WHOLE),
    **Dtype.WHOLE.columns("labels"),
    "without_modification": ("missed", Dtype.WHOLE),
}


def fault_sheet(table: FaultTable) -> Sheet:
    """Return one row a contestant; counts are empty where nothing was labelled."""
    facts = {"job": table.job} | ({"note": table.note} if table.note else {})
    return make_sheet(table.lines, COLUMNS, name="faults", facts=facts)


def fault_latex(table: FaultTable) -> bytes:
    """Return the paper's table "Error Count per Category".

    Beside the paper's columns stand unreadable and refused answers, and how many were judged.
    """
    comments = [f"{table.job}: {table.labels} labels"]
    comments += [
        f"{line['fault']}: Cohen's kappa of the checks' first guess and the experts "
        f"{_format(line['kappa'])} (n={line['n']}), Krippendorff's alpha of the experts among "
        f"themselves {_format(line['alpha'])} (pictures={line['pictures']})"
        for line in table.agreement
    ]
    columns: ValueColumns = {
        "Model": itemgetter("shown_name"),
        **{name.capitalize(): itemgetter(name) for name in COUNTS},
        "No answer": itemgetter("missed"),
        "n": itemgetter("counted"),
    }
    counted = [line for line in table.lines if line["counted"]]
    caption, label = f"Error Count per Category. {table.note}".rstrip(), "tab:manual_eval"
    return latex_values(counted, columns, comments=comments, caption=caption, label=label)


FORMATS = table_formats(fault_sheet) | formats(latex=fault_latex)


def _is_seen(fault: FaultClass, labels: Sequence[FaultLabel]) -> bool:
    seen: int = sum(getattr(label, fault.value) for label in labels)
    return 2 * seen > len(labels)


def _agreement(
    fault: FaultClass, labels: Sequence[FaultLabel], of_rows: Iterable[list[FaultLabel]]
) -> dict[str, Any]:
    guessed = [label for label in labels if label.guessed_position is not None]
    several = [own for own in of_rows if len(own) > 1]
    alpha = None
    if several:  # how often "no", nothing and "yes" was said of each augmentation
        seen = np.array([sum(getattr(label, fault.value) for label in own) for own in several])
        votes = np.column_stack([[len(own) for own in several] - seen, np.zeros_like(seen), seen])
        alpha = krippendorff_alpha(votes.astype(np.int64), DifferenceMetric.NOMINAL)
    return {
        "fault": fault.value,
        "kappa": cohens_kappa(
            [getattr(label, f"guessed_{fault.value}") for label in guessed],
            [getattr(label, fault.value) for label in guessed],
        ),
        "n": len(guessed),
        "alpha": alpha,
        "pictures": len(several),
    }


def _format(value: float | None) -> str:
    return "undefined" if value is None else f"{value:.2f}"
