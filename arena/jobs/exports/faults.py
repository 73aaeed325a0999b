"""Fault labels of a job in the form of the paper's table, and how well the checks foresaw them."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from arena.exports.cells import csv_text
from arena.exports.formats import Format, formats
from arena.jobs.queries import contestants_of, labels_of
from arena.models import FaultLabel
from arena.rating.lines import escape
from arena.rating.reliability import DifferenceMetric, cohens_kappa, krippendorff_alpha
from arena.results.exports.tables import shown_name
from augment.models import GenerationJob
from augment.services.judging.findings import FaultClass

COLUMNS = (
    "contestant",
    "slug",
    "simulated",
    "all",
    "position",
    "heading",
    "logic",
    "augmentations_labelled",
    "labels",
    "without_modification",
)


NOT_LABELLED = "--"


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultLine:
    """One contestant's faults.

    Attributes:
        counts: Augmentations by class of fault; an augmentation with two counts in both.
        labelled: Augmentations with a label.
        labels: Labels on them, over all experts.
        without_modification: Unreadable and refused answers: nobody labels them, each is a miss.
    """

    name: str
    slug: str
    is_simulated: bool
    counts: dict[FaultClass, int]
    labelled: int
    labels: int
    without_modification: int

    @property
    def all(self) -> int:
        """The sum over the classes, as the paper has it, and one for each answer that is none."""
        return sum(self.counts.values()) + self.without_modification

    @property
    def counted(self) -> int:
        """Augmentations that are judged: labelled, or without anything to label."""
        return self.labelled + self.without_modification

    @property
    def shown_counts(self) -> tuple[int | str, ...]:
        """All, position, heading and logic; a dash where nothing was labelled.

        Answers without a modification count in the sum of all, labelled or not.
        """
        by_class = self.counts.values() if self.labelled else [NOT_LABELLED] * len(FaultClass)
        return self.all if self.counted else NOT_LABELLED, *by_class

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
    """Return the table of a job; three queries, which read a row a label and a row a contestant.

    Of several experts on one augmentation a fault counts where more than half of them see it.
    """
    labels = list(labels_of(job))
    by_augmentation: defaultdict[int, list[FaultLabel]] = defaultdict(list)
    for label in labels:
        by_augmentation[label.augmentation_id].append(label)
    by_contestant: defaultdict[int, list[list[FaultLabel]]] = defaultdict(list)
    for own in by_augmentation.values():
        by_contestant[own[0].augmentation.contestant_id].append(own)
    return FaultTable(
        job=job.name,
        lines=tuple(
            FaultLine(
                name=who.name,
                slug=who.slug,
                is_simulated=who.is_simulated,
                counts={
                    fault: sum(_is_seen(fault, own) for own in by_contestant[who.pk])
                    for fault in FaultClass
                },
                labelled=len(by_contestant[who.pk]),
                labels=sum(map(len, by_contestant[who.pk])),
                without_modification=missed,
            )
            for who, missed in contestants_of(job)
        ),
        agreement=tuple(
            _agreement(fault, labels, by_augmentation.values()) for fault in FaultClass
        ),
    )


def csv_bytes(table: FaultTable) -> bytes:
    """Return one line a contestant; counts are empty where nothing was labelled."""
    rows = (
        (
            line.shown_name,
            line.slug,
            line.is_simulated,
            *("" if count == NOT_LABELLED else count for count in line.shown_counts),
            line.labelled,
            line.labels,
            line.without_modification,
        )
        for line in table.lines
    )
    return csv_text(COLUMNS, rows).encode()


def latex(table: FaultTable) -> bytes:
    """Return the paper's table "Error Count per Category"; needs booktabs and xcolor (`table`).

    Beside the paper's columns stand unreadable and refused answers, and how many were judged.
    """
    kappas = (f"{one.fault} {_printed(one.kappa)} (n={one.n})" for one in table.agreement)
    alphas = (
        f"{one.fault} {_printed(one.alpha)} (pictures={one.pictures})" for one in table.agreement
    )
    lines = [
        r"% \usepackage{booktabs} and \usepackage[table]{xcolor}",
        f"% {' '.join(table.job.split())}: {table.labels} labels",
        f"% Cohen's kappa of the checks' first guess and the experts: {', '.join(kappas)}",
        f"% Krippendorff's alpha of the experts among themselves: {', '.join(alphas)}",
        r"\providecolor{llm_blue}{RGB}{105, 156, 219}",
        r"\begin{table}",
        r"    \centering",
        r"    \begin{tabular}{l>{\columncolor{llm_blue!20}}rrrrrr}",
        r"    \toprule",
        r"    \textbf{Model} & \textbf{All}~$\downarrow$ & \textbf{Position}~$\downarrow$"
        r" & \textbf{Heading}~$\downarrow$ & \textbf{Logic}~$\downarrow$"
        r" & \textbf{No answer}~$\downarrow$ & \textbf{n} \\",
        r"    \midrule",
        *(
            f"    {escape(line.shown_name)} & {' & '.join(map(str, line.shown_counts))} "
            rf"& {line.without_modification} & {line.counted}\\"
            for line in table.lines
            if line.counted
        ),
        r"    \bottomrule",
        r"    \end{tabular}",
        r"    \caption{Error Count per Category.}",
        r"    \label{tab:manual_eval}",
        r"\end{table}",
    ]
    return ("\n".join(lines) + "\n").encode()


FORMATS: dict[str, Format[FaultTable]] = formats(csv=csv_bytes, latex=latex)


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
