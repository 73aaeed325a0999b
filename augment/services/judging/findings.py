"""What the geometric checks measure about a stored augmentation, as sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from augment.checks import Finding as Finding
from augment.checks import FindingKind as FindingKind
from augment.checks import Severity
from augment.errors import InvalidDocument, InvalidModification
from augment.models import Augmentation
from augment.scene.codec import EGO_ID as EGO_ID
from augment.services.judging.findings import findings_of, is_drawn, marked_name, order_faults


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingLine:
    """One finding.

    Attributes:
        severity: "wrong", "doubtful" or "fact".
        kind: What was measured, in words: "off road".
        fault: The class of fault that it speaks for, empty for a fact.
        finding: In full; its sentence calls agents by their ids in the modification.
    """

    severity: str
    kind: str
    fault: str
    finding: Finding


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """All findings of one augmentation, the worst first.

    Attributes:
        problem: Why nothing could be checked, empty where it was.
        is_against_intent: Whether the scenario has an intent that it was held against.
        picture: The name of the picture that shows the faults by their numbers, empty without.
        is_drawn: Whether that picture is there.
    """

    lines: tuple[FindingLine, ...] = ()
    is_against_intent: bool = False
    picture: str = ""
    is_drawn: bool = False
    problem: str = ""

    @property
    def faults(self) -> list[FindingLine]:
        """What is wrong or doubtful, in the order of the numbers in the picture."""
        return [line for line in self.lines if line.severity != Severity.FACT]

    @property
    def facts(self) -> list[FindingLine]:
        """Plain measurements."""
        return [line for line in self.lines if line.severity == Severity.FACT]


def check_augmentation(row: Augmentation) -> Checked | None:
    """The findings of a row whose scenario and scene are loaded; None without a modification."""
    if row.modification is None:
        return None
    try:
        findings = findings_of(row)
    except (InvalidDocument, InvalidModification) as error:
        return Checked(problem=str(error))
    name = marked_name(row, findings)
    return Checked(
        lines=list_lines(findings),
        is_against_intent=row.scenario.intent is not None,
        picture=name,
        is_drawn=is_drawn(name),
    )


def list_lines(findings: Sequence[Finding]) -> tuple[FindingLine, ...]:
    """The findings as lines: the wrong, the doubtful, then plain measurements."""
    facts = [one for one in findings if not one.is_fault]
    return tuple(_line(one) for one in (*order_faults(findings), *facts))


def _line(one: Finding) -> FindingLine:
    return FindingLine(
        severity=one.severity.value,
        kind=one.kind.value.replace("_", " "),
        fault=one.fault.value if one.is_fault else "",
        finding=one,
    )
