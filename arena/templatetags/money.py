"""Amounts of money, and other big numbers, as a person reads them."""

from __future__ import annotations

from decimal import Decimal

from django import template
from django.utils.formats import number_format

register = template.Library()

_SMALLEST = Decimal("0.0001")


@register.filter
def usd(amount: Decimal | None) -> str:
    """An amount in dollars: in cents where it is whole ones, else to a hundredth of a cent.

    Unknown is said in words and never shown as zero.
    """
    if amount is None:
        return "unknown"
    if amount == amount.quantize(Decimal("0.01")):
        return f"${amount:,.2f}"
    if amount < _SMALLEST:
        return "less than $0.0001"
    return f"${amount:,.4f}"


@register.filter
def grouped(number: int | None) -> str:
    """A whole number in groups of three digits; empty where there is none."""
    return "" if number is None else number_format(number, force_grouping=True)
