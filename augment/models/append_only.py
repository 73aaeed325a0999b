"""Rows that are written once."""

from __future__ import annotations

from typing import Any

from django.db import models


class AppendOnly(models.Model):
    """A row that is never changed: what changes it is another row."""

    class Meta:
        abstract = True

    def save(self, *args: Any, **kwargs: Any) -> None:
        """Insert the row.

        Raises:
            TypeError: It is stored already.
        """
        if not self._state.adding:
            name = self._meta.verbose_name
            raise TypeError(f"a {name} is append-only: a stored one can't be changed")
        super().save(*args, **kwargs)
