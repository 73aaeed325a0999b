"""Studies whose experts may read what was changed."""

from arena.models import Study
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import Cast, cast_of


def draw_changes() -> None:
    """Every augmentation adds a vehicle: the n-th n metres ahead, named after who made it."""
    rows = Augmentation.objects.select_related("contestant").order_by("pk")
    for number, row in enumerate(rows, start=1):
        added = vehicle(f"{row.contestant.slug}{number}", float(number), -1.5)
        row.modification = modification_to_document(Modification(added=(added,)))
        row.save(update_fields=["modification"])


def said_of(row: Augmentation) -> list[str]:
    """What an expert reads of one of these augmentations."""
    (added,) = row.modification["add"]  # type: ignore[index]
    return [f"Vehicle, {added['x_m']:.1f} m ahead, 1.5 m right, facing as the ego does, standing"]


def with_text(cast: Cast, *, votes: int = 9, **options: object) -> Study:
    """An open study of this cast, with further rules."""
    return open_study(
        name="Round 1", votes_per_expert=votes, seed=7, allow_text=True, **options, **cast
    )


def a_described_study(**cast: object) -> Study:
    """As tests.study_rows.a_study, with changes to read of."""
    made = cast_of(**cast)  # type: ignore[arg-type]
    draw_changes()
    return with_text(made)
