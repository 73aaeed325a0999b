"""What all charts for papers share: the colours, and bytes that never differ between two runs."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, SOFT, GRID, MARK, SIMULATED = "#1d2733", "#5b6773", "#d5dbe3", "#2f6db5", "#7a4fae"
DPI = 200

# Nothing that differs between two runs may get into a file: no date, no random ids, no version.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}

_ONE_AT_A_TIME = Lock()


@contextmanager
def house_style() -> Iterator[None]:
    """The settings of matplotlib under which every chart is drawn.

    They belong to the whole process: a chart that ends would take them away from one that another
    thread of the web server is drawing. So charts wait for each other.
    """
    import matplotlib

    settings: dict[Any, Any] = {
        "svg.hashsalt": "scenario-arena",
        "svg.fonttype": "none",
        "pdf.fonttype": 42,  # publishers refuse Type 3, matplotlib's usual form
        "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    }
    with _ONE_AT_A_TIME, matplotlib.rc_context(settings):
        yield


def width_in(text: str, size_pt: float) -> float:
    """How many inches a text takes; call it within `house_style`."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0.0, 0.0), text, size=size_pt).get_extents().width) / 72.0


def write_figure(figure: Figure, file_format: str) -> bytes:
    """The figure as the bytes of a file.

    Args:
        figure: Made and filled within `house_style`.
        file_format: "svg", "pdf" or "png".
    """
    picture = io.BytesIO()
    figure.savefig(picture, format=file_format, dpi=DPI, metadata=_METADATA[file_format])
    return picture.getvalue()
