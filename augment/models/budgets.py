"""Caps of all rows that ask language models."""

from decimal import Decimal

from django.db import models

from augment.llm.costs import to_usd
from augment.models.work import CodedModel


class CappedWork(CodedModel):
    """Work at language models, within caps on what it may use.

    Money is counted in whole nano-dollars, so that sums are exact on every database. Each call
    moves its worst case into `reserved_*` before it is sent, and what it used into `spent_*`
    afterwards; a cap is compared with the sum of both. Null is no cap.
    """

    cap_nano_usd = models.PositiveBigIntegerField(null=True, blank=True)
    cap_calls = models.PositiveIntegerField(null=True, blank=True)
    cap_tokens = models.PositiveBigIntegerField(null=True, blank=True)
    reserved_nano_usd = models.PositiveBigIntegerField(default=0)
    reserved_calls = models.PositiveIntegerField(default=0)
    reserved_tokens = models.PositiveBigIntegerField(default=0)
    spent_nano_usd = models.PositiveBigIntegerField(default=0)
    spent_calls = models.PositiveIntegerField(default=0)
    spent_tokens = models.PositiveBigIntegerField(default=0)
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        abstract = True

    @property
    def is_capped(self) -> bool:
        """True if there is any cap."""
        caps = (self.cap_nano_usd, self.cap_calls, self.cap_tokens)
        return any(cap is not None for cap in caps)

    @property
    def cap_usd(self) -> Decimal | None:
        """The money cap, None without one."""
        return None if self.cap_nano_usd is None else to_usd(self.cap_nano_usd)

    @property
    def reserved_usd(self) -> Decimal:
        """The worst case of the calls in flight, as far as their prices are known."""
        return to_usd(self.reserved_nano_usd)

    @property
    def spent_usd(self) -> Decimal:
        """Cost so far, as far as prices are known."""
        return to_usd(self.spent_nano_usd)
