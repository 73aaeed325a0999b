"""Rows that are written once."""

from __future__ import annotations

from typing import Any, ClassVar

from django.db import models


class AppendOnly(models.Model):
    """A row that is never changed or deleted: what changes it is another row.

    The database refuses it as well, whoever asks: see `augment.models.work`.
    """

    removable: ClassVar[str] = ""
    """Which rows may be deleted all the same: an SQL condition on OLD, none by default."""

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

    def delete(self, *args: Any, **kwargs: Any) -> tuple[int, dict[str, int]]:
        """Never.

        Raises:
            TypeError: Always.
        """
        name = self._meta.verbose_name
        raise TypeError(f"a {name} is append-only: a stored one can't be deleted")
