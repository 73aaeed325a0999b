"""Writes of augment, one subject a file: keyword-only functions that return rows."""

from augment.services.clock import DATABASE_TIME, Moment
from augment.services.events import log_change, retire
from augment.services.inputs import (
    Input,
    InputKind,
    add_options,
    input_field,
    read_request,
    read_values,
    to_inputs,
)
from augment.services.terminal import TerminalCommand, at_least
from augment.services.texts import (
    SLUG_LENGTH,
    check_picture_name,
    check_prose,
    free_slug,
    is_readable_line,
    is_stored_name,
    make_slug,
    make_storable,
    motion_in_words,
    one_line,
    read_code,
)
from augment.services.work import KINDS, Lease, Settlement, WorkKind, is_passing, register
