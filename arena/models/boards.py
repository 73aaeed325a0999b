"""Boards: series of studies over one set of scenarios, and their dated tables."""

import json
from functools import cached_property

from django.db import models

from arena.models.studies import Study
from arena.rating.board_table import PROVISIONAL_ABOVE, BoardTableDocument
from arena.rating.snapshot_document import read_document
from augment.models import AppendOnly, Benchmark, CodedModel


class Board(CodedModel):
    """A series of studies, the first one and then batches, whose votes are rated together."""

    name = models.CharField(max_length=100, unique=True)
    benchmark = models.ForeignKey(
        Benchmark,
        null=True,
        blank=True,
        on_delete=models.PROTECT,
        related_name="boards",
        help_text="whose test split all studies show; null for scenarios of no benchmark",
    )
    studies = models.ManyToManyField(Study, related_name="boards")
    token = models.CharField(
        max_length=40,
        unique=True,
        null=True,
        blank=True,
        help_text="of the link by which anybody reads its tables; null without one",
    )
    provisional_above = models.PositiveIntegerField(
        default=PROVISIONAL_ABOVE,
        help_text="points to either side; a wider interval makes a line provisional",
    )
    made_at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-made_at", "-pk")

    def __str__(self) -> str:
        return self.name


class BoardTable(AppendOnly):
    """A published table. Its files are kept as they were written, whatever writes them today."""

    board = models.ForeignKey(Board, on_delete=models.PROTECT, related_name="tables")
    number = models.PositiveIntegerField(help_text="from 1")
    made_at = models.DateTimeField()
    files = models.JSONField(help_text="the text of each file, by its ending")

    class Meta:
        ordering = ("-number",)
        constraints = (
            models.UniqueConstraint(name="one_table_per_number", fields=("board", "number")),
        )

    @cached_property
    def document(self) -> BoardTableDocument:
        """Content of the table as a typed value."""
        document = json.loads(self.files["json"])
        return read_document(BoardTableDocument, document, what="board table")
