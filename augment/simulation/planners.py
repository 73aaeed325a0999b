"""Planners by name, and anybody's own by the dotted path of its class."""

import importlib
from collections.abc import Collection

from augment.errors import CannotDrive, UnknownName, check_names
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PAPER_OFFSETS_M, PdmClosed
from augment.simulation.planning import IdmPlanner, Planner, is_of_signal

OFFSETS_M: dict[str, tuple[float, ...]] = {
    "paper": PAPER_OFFSETS_M,
    "original": ORIGINAL_OFFSETS_M,
}
"""The lateral offsets of PDM-Closed: the paper's up to 4 m, the released code's of 1 m."""

PDM_CLOSED, IDM = "pdm-closed", "idm"
NAMED = (PDM_CLOSED, IDM)


def planner_named(name: str, *, offsets: str = "paper", allowed: Collection[str] = ()) -> Planner:
    """Return a fresh planner; the only place where a planner's module is imported.

    Args:
        name: One of `NAMED`, or one of `allowed`.
        offsets: One of `OFFSETS_M`; PDM-Closed's alone.
        allowed: Dotted paths of classes without arguments that may be imported.

    Raises:
        UnknownName: The name is not allowed, or there are no such offsets.
        CannotDrive: The path leads to nothing, or to something that is no planner.
    """
    check_names("offsets", [offsets], OFFSETS_M)
    if name == PDM_CLOSED:
        return PdmClosed(OFFSETS_M[offsets])
    if name == IDM:
        return IdmPlanner()
    paths = [path for path in allowed if "." in path]
    if name not in paths:
        raise UnknownName("planner", name, [*NAMED, *paths])
    module, _, attribute = name.rpartition(".")
    try:
        planner = getattr(importlib.import_module(module), attribute)()
    except (Exception, SystemExit) as error:
        if is_of_signal(error):
            raise
        raise CannotDrive(
            f"The planner {name} can't be made ({type(error).__name__}: {error}). It is the "
            "dotted path of a class without arguments."
        ) from error
    if not isinstance(planner, Planner):
        raise CannotDrive(
            f"{name} is no planner: it needs the methods start(road, body) and plan(situation)."
        )
    return planner
