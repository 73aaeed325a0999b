"""Every format that scenarios can be written in, by its name."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from augment.errors import check_names
from augment.formats import own_json
from augment.formats.commonroad import writer as commonroad_writer
from augment.formats.interplan import writer as interplan_writer
from augment.formats.openscenario import writer as openscenario_writer
from augment.formats.scenarionet import writer as scenarionet_writer
from augment.formats.writing import CannotExpress, Cell, Loss, Output, Writer, check_finite

WRITERS: Final[dict[str, Writer]] = {
    "json": own_json.write,
    "interplan": interplan_writer.write,
    "commonroad": commonroad_writer.write,
    "openscenario": openscenario_writer.write,
    "scenarionet": scenarionet_writer.write,
}


def writer_named(name: str) -> Writer:
    """Return the writer of that format; all of them refuse numbers that are not finite.

    Raises:
        UnknownName: There is no writer of that name.
    """
    check_names("format", [name], WRITERS)
    return partial(_write_finite, WRITERS[name])


# Private


def _write_finite(writer: Writer, cells: Sequence[Cell]) -> Output:
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
