"""What the paper published of its displacement errors, to stand beside our own. Read-only.

Nothing here was measured by this project: the numbers are read from the paper's box plot by eye,
to a tenth of a metre. Lower whiskers (0.0 to 0.4 m) can't be told apart there, means and numbers
of objects are not given, outliers are not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

SOURCE = "read from the paper's figure"


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedBox:
    """One box of the paper's figure "Displacement error by variant", in metres."""

    model: str
    variant: str
    q1_m: float
    median_m: float
    q3_m: float
    high_m: float


_FIGURE = (
    ("GPT-4o", "OTM", 1.2, 1.5, 2.1, 2.9),
    ("Gemini-1.5-Flash", "OTM", 1.0, 1.4, 3.9, 5.2),
    ("Llama3.1-70B", "OTM", 0.9, 2.7, 7.3, 9.7),
    ("GPT-4o", "FC", 0.3, 0.5, 1.2, 1.9),
    ("Gemini-1.5-Flash", "FC", 0.2, 0.4, 0.8, 1.8),
    ("Llama3.1-70B", "FC", 0.3, 0.7, 1.4, 1.8),
    ("GPT-4o", "tQA", 1.1, 1.4, 2.4, 3.9),
    ("Gemini-1.5-Flash", "tQA", 0.6, 1.0, 2.4, 4.8),
    ("Llama3.1-70B", "tQA", 0.9, 1.4, 3.2, 4.2),
    ("Gemini-1.5-Flash", "vQA", 0.9, 1.3, 2.9, 4.8),
)

BY_VARIANT = tuple(
    PublishedBox(model=model, variant=variant, q1_m=q1, median_m=median, q3_m=q3, high_m=high)
    for model, variant, q1, median, q3, high in _FIGURE
)
