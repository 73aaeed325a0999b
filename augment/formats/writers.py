"""Every format that scenarios can be written in, by its name."""

from typing import Final

from augment.errors import check_names
from augment.formats import own_json
from augment.formats.commonroad import writer as commonroad_writer
from augment.formats.interplan import writer as interplan_writer
from augment.formats.openscenario import writer as openscenario_writer
from augment.formats.scenarionet import writer as scenarionet_writer
from augment.formats.writing import Writer

WRITERS: Final[dict[str, Writer]] = {
    "json": own_json.write,
    "interplan": interplan_writer.write,
    "commonroad": commonroad_writer.write,
    "openscenario": openscenario_writer.write,
    "scenarionet": scenarionet_writer.write,
}


def writer_named(name: str) -> Writer:
    """Return the writer of that format.

    Raises:
        UnknownName: There is no writer of that name.
    """
    check_names("format", [name], WRITERS)
    return WRITERS[name]
