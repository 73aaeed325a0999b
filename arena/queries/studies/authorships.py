"""Who is marked author of what in a study; nothing here is for experts' eyes."""

from __future__ import annotations

from arena.models import Authorship, Study
from arena.queries.people import natural_order


def authorships_of(study: Study) -> list[Authorship]:
    """Every mark of a study with its people and contestants, by pseudonym; one query."""
    rows = study.authorships.select_related("expert__person", "contestant", "marked_by__person")
    return sorted(
        rows, key=lambda row: (natural_order(row.expert.person.pseudonym), row.contestant.name)
    )


def authors_of(study: Study) -> frozenset[tuple[str, str]]:
    """The same as votes name them: an expert's code with a contestant's slug."""
    rows = study.authorships.order_by().values_list("expert__person__code", "contestant__slug")
    return frozenset((str(code), slug) for code, slug in rows)
