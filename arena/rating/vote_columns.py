"""Columns of a written file of votes, by the version that a snapshot keeps."""

COLUMNS = (
    "model_a",
    "model_b",
    "winner",
    "judge",
    "item",
    "type",
    "kind",
    "side",
    "ms_visible",
    "simulated",
    "at",
    "position",
    "aids",
    "comment",
    "augmentation_a",
    "augmentation_b",
    "strength",
    "question",
    "faults",
)
"""The first three are Chatbot Arena's; `model_a` was on the left, `side` is the winner's.
`augmentation_a` is the code of what `model_a` made. `faults` is what was marked as wrong: JSON, a
list of side, id of the object and class each, empty for nothing."""

VERSION = 5
"""Of the columns, kept with a snapshot: its file and the hash of it stay as they were."""

_WIDTHS = {1: 10, 2: 16, 3: 17, 4: 18, VERSION: len(COLUMNS)}
"""So many columns, the first ones, by version."""


def vote_columns(version: int) -> tuple[str, ...]:
    """The columns of a version."""
    return COLUMNS[: _WIDTHS[version]]
