"""What the geometric checks measure about a stored augmentation, as sentences."""

from __future__ import annotations

from dataclasses import dataclass

from augment.checks import Severity, findings
from augment.errors import InvalidDocument, InvalidModification
from augment.models import Augmentation
from augment.scene.codec import modification_from_document
from augment.services.scenes import scene_of

_ORDER = (Severity.WRONG, Severity.DOUBTFUL, Severity.FACT)


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingLine:
    """One finding.

    Attributes:
        severity: "wrong", "doubtful" or "fact".
        kind: What was measured, in words: "off road".
        sentence: With its numbers; agents go by their ids in the modification.
    """

    severity: str
    kind: str
    sentence: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """All findings of one augmentation, the worst first.

    Attributes:
        problem: Why nothing could be checked, empty where it was.
    """

    lines: tuple[FindingLine, ...] = ()
    problem: str = ""

    @property
    def faults(self) -> list[FindingLine]:
        """What is wrong or doubtful."""
        return [line for line in self.lines if line.severity != Severity.FACT]

    @property
    def facts(self) -> list[FindingLine]:
        """Plain measurements."""
        return [line for line in self.lines if line.severity == Severity.FACT]


def checked(row: Augmentation) -> Checked | None:
    """The findings of a row whose scenario and scene are loaded; None without a modification."""
    if row.modification is None:
        return None
    try:
        found = findings(scene_of(row.scenario), modification_from_document(row.modification))
    except (InvalidDocument, InvalidModification) as error:
        return Checked(problem=str(error))
    lines = [
        FindingLine(
            severity=one.severity.value,
            kind=one.kind.value.replace("_", " "),
            sentence=one.sentence(),
        )
        for severity in _ORDER
        for one in found
        if one.severity is severity
    ]
    return Checked(lines=tuple(lines))
