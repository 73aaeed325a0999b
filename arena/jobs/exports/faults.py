"""Fault labels of a job in the form of the paper's table, and how well the checks foresaw them."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from django.db.models import Count, Q

from arena.exports.formats import (
    TEXT,
    WHOLE,
    YES_NO,
    Columns,
    Sheet,
    formats,
    sheet_of,
    table_formats,
)
from arena.models import FaultLabel
from arena.rating.lines import UNKNOWN, escape, latex_table
from arena.rating.reliability import DifferenceMetric, cohens_kappa, krippendorff_alpha
from arena.results.exports.tables import shown_name
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.judging.findings import FaultClass

_MISSES = (Augmentation.State.UNREADABLE, Augmentation.State.REFUSED)
_LABEL = (
    *("augmentation", "position", "heading", "logic", "augmentation__contestant"),
    *("guessed_position", "guessed_heading", "guessed_logic"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultLine:
    """One contestant's faults.

    Attributes:
        position, heading, logic: Augmentations with that fault, one with two counts in both; None
            where nothing was labelled.
        labelled: Augmentations with a label.
        labels: Labels on them, over all experts.
        without_modification: Unreadable and refused answers: nobody labels them, each is a miss.
    """

    name: str
    slug: str
    is_simulated: bool
    position: int | None
    heading: int | None
    logic: int | None
    labelled: int
    labels: int
    without_modification: int

    @property
    def all(self) -> int | None:
        """The sum over the classes, as the paper has it, and one for each answer that is none."""
        seen = sum(count or 0 for count in (self.position, self.heading, self.logic))
        return seen + self.without_modification if self.counted else None

    @property
    def counted(self) -> int:
        """Augmentations that are judged: labelled, or without anything to label."""
        return self.labelled + self.without_modification

    @property
    def shown_counts(self) -> tuple[str, ...]:
        """All, position, heading and logic; two hyphens where nothing was labelled."""
        counts = (self.all, self.position, self.heading, self.logic)
        return tuple(UNKNOWN if count is None else str(count) for count in counts)

    @property
    def shown_name(self) -> str:
        """The name, with "(simulated)" where that is so."""
        return shown_name(self.name, self.is_simulated)


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelAgreement:
    """How well the labels of one class of faults agree; None is undefined.

    Attributes:
        kappa: Cohen's, of the checks' first guess and the experts.
        n: Labels with a guess beside them.
        alpha: Krippendorff's, nominal, of the experts among themselves.
        pictures: Augmentations that at least two experts have labelled.
    """

    fault: str
    kappa: float | None
    n: int
    alpha: float | None
    pictures: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTable:
    """All contestants of a job, by name."""

    job: str
    lines: tuple[FaultLine, ...]
    agreement: tuple[LabelAgreement, ...]

    @property
    def labels(self) -> int:
        """Over all contestants."""
        return sum(line.labels for line in self.lines)

    @property
    def counted(self) -> int:
        """Augmentations that are judged, over all contestants."""
        return sum(line.counted for line in self.lines)


def fault_table(job: GenerationJob) -> FaultTable:
    """Return the table of a job; two queries, which read a row a label and a row a contestant.

    Of several experts on one augmentation a fault counts where more than half of them see it.
    """
    rows = FaultLabel.objects.filter(augmentation__job=job).select_related("augmentation")
    labels = list(rows.only(*_LABEL).order_by("augmentation", "pk"))
    by_augmentation: defaultdict[int, list[FaultLabel]] = defaultdict(list)
    for label in labels:
        by_augmentation[label.augmentation_id].append(label)
    by_contestant: defaultdict[int, list[list[FaultLabel]]] = defaultdict(list)
    for own in by_augmentation.values():
        by_contestant[own[0].augmentation.contestant_id].append(own)
    mine = Q(augmentations__job=job)
    missed = Count("augmentations", filter=mine & Q(augmentations__state__in=_MISSES))
    contestants = Contestant.objects.filter(mine).annotate(missed=missed)
    lines = []
    for who in contestants.only("name", "slug", "kind").order_by("name", "slug"):
        labelled = by_contestant[who.pk]
        counts = {
            fault.value: sum(_is_seen(fault, own) for own in labelled) if labelled else None
            for fault in FaultClass
        }
        line = FaultLine(
            name=who.name,
            slug=who.slug,
            is_simulated=who.is_simulated,
            labelled=len(labelled),
            labels=sum(map(len, labelled)),
            without_modification=who.missed,
            **counts,
        )
        lines.append(line)
    agreement = tuple(_agreement(fault, labels, by_augmentation.values()) for fault in FaultClass)
    return FaultTable(job=job.name, lines=tuple(lines), agreement=agreement)


COLUMNS: Columns = {
    "contestant": ("shown_name", TEXT),
    "slug": ("slug", TEXT),
    "simulated": ("is_simulated", YES_NO),
    **{name: (name, WHOLE) for name in ("all", "position", "heading", "logic")},
    "augmentations_labelled": ("labelled", WHOLE),
    "labels": ("labels", WHOLE),
    "without_modification": ("without_modification", WHOLE),
}


def fault_sheet(table: FaultTable) -> Sheet:
    """Return one row a contestant; counts are empty where nothing was labelled."""
    return sheet_of(table.lines, COLUMNS, name="faults", facts={"job": table.job})


def fault_latex(table: FaultTable) -> bytes:
    """Return the paper's table "Error Count per Category".

    Beside the paper's columns stand unreadable and refused answers, and how many were judged.
    """
    comments = [f"{table.job}: {table.labels} labels"]
    comments += [
        f"{line.fault}: Cohen's kappa of the checks' first guess and the experts "
        f"{_printed(line.kappa)} (n={line.n}), Krippendorff's alpha of the experts among "
        f"themselves {_printed(line.alpha)} (pictures={line.pictures})"
        for line in table.agreement
    ]
    rows = (
        (
            escape(line.shown_name),
            *line.shown_counts,
            *(str(line.without_modification), str(line.counted)),
        )
        for line in table.lines
        if line.counted
    )
    heads = ("Model", "All", "Position", "Heading", "Logic", "No answer", "n")
    caption = "Error Count per Category."
    text = latex_table(
        rows, heads=heads, comments=comments, caption=caption, label="tab:manual_eval"
    )
    return text.encode()


FORMATS = table_formats(fault_sheet) | formats(latex=fault_latex)


def _is_seen(fault: FaultClass, labels: Sequence[FaultLabel]) -> bool:
    seen: int = sum(getattr(label, fault.value) for label in labels)
    return 2 * seen > len(labels)


def _agreement(
    fault: FaultClass, labels: Sequence[FaultLabel], of_rows: Iterable[list[FaultLabel]]
) -> LabelAgreement:
    guessed = [label for label in labels if label.guessed_position is not None]
    several = [own for own in of_rows if len(own) > 1]
    alpha = None
    if several:  # how often "no", nothing and "yes" was said of each augmentation
        seen = np.array([sum(getattr(label, fault.value) for label in own) for own in several])
        said = np.column_stack([[len(own) for own in several] - seen, np.zeros_like(seen), seen])
        alpha = krippendorff_alpha(said.astype(np.int64), DifferenceMetric.NOMINAL)
    return LabelAgreement(
        fault=fault.value,
        kappa=cohens_kappa(
            [getattr(label, f"guessed_{fault.value}") for label in guessed],
            [getattr(label, fault.value) for label in guessed],
        ),
        n=len(guessed),
        alpha=alpha,
        pictures=len(several),
    )


def _printed(value: float | None) -> str:
    return "undefined" if value is None else f"{value:.2f}"
