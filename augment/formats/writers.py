"""Every format that scenarios can be written in, by its name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from augment.errors import UnknownName
from augment.formats import (
    commonroad_writer,
    interplan_writer,
    openscenario_writer,
    own_writer,
    scenarionet_writer,
)
from augment.formats.writing import Cell, Writer, Written


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
    """How to write that format.

    Raises:
        UnknownName: There is no writer of that name.
    """
    if name not in WRITERS:
        raise UnknownName("format", name, list(WRITERS))
    return WRITERS[name]
