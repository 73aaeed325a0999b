"""Every format that scenarios can be written in, by its name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from augment.errors import UnknownName
from augment.formats import (
    commonroad_writer,
    interplan_writer,
    openscenario_writer,
    own_writer,
    scenarionet_writer,
)
from augment.formats.writing import CannotExpress, Cell, Loss, Writer, Written, check_finite


def write_interplan(cells: Sequence[Cell]) -> Written:
    """One YAML file for all of them."""
    text, losses = interplan_writer.write(cells)
    return Written(files={"interplan.yaml": text.encode()}, losses=losses)


WRITERS: Final[dict[str, Writer]] = {
    "json": own_writer.write,
    "interplan": write_interplan,
    "commonroad": commonroad_writer.write,
    "openscenario": openscenario_writer.write,
    "scenarionet": scenarionet_writer.write,
}


def writer_named(name: str) -> Writer:
    """How to write that format; what holds a number that is not finite is refused in all of them.

    Raises:
        UnknownName: There is no writer of that name.
    """
    if name not in WRITERS:
        raise UnknownName("format", name, list(WRITERS))
    return partial(_write_finite, WRITERS[name])


# Private


def _write_finite(writer: Writer, cells: Sequence[Cell]) -> Written:
    finite, refused = [], []
    for cell in cells:
        try:
            check_finite(cell)
        except CannotExpress as reason:
            refused.append(Loss(cell=cell.name, text=str(reason), changes_scene=True))
        else:
            finite.append(cell)
    written = writer(finite)
    return replace(written, refused=(*refused, *written.refused))
