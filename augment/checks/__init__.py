"""Deterministic checks of a modification: each finding is a measured fact with its numbers."""

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.ground import Ground
from augment.checks.registry import findings_on

__all__ = ["Finding", "FindingKind", "Ground", "Severity", "findings_on"]
