"""Arguments that several commands share."""

from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Callable
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

from django.conf import settings

from augment.scene.entities import CatalogueSet
from augment.services.running.budget import Caps
from augment.services.scenarios.catalogue import folder_of
from augment.variants.options import EFFORTS, ContestantOptions, options_from_document


def add_cap_arguments(parser: ArgumentParser) -> None:
    """--cap USD, --cap-calls N, --cap-tokens N: the first that is reached stops the job."""
    parser.add_argument(
        "--cap",
        "--cap-usd",
        dest="cap_usd",
        type=_usd,
        metavar="USD",
        help="money that language models may cost at most; needs their prices",
    )
    parser.add_argument("--cap-calls", type=int, metavar="N", help="calls to language models")
    parser.add_argument("--cap-tokens", type=int, metavar="N", help="tokens, in and out together")


def caps_of(options: dict[str, Any]) -> Caps:
    """Return the caps that were given."""
    return Caps(usd=options["cap_usd"], calls=options["cap_calls"], tokens=options["cap_tokens"])


def add_option_arguments(parser: ArgumentParser) -> None:
    """--temperature, --seed, ...: the options of a contestant, each open unless it is given."""
    group = parser.add_argument_group(
        "options", "how it asks; a contestant that has run keeps its own for ever"
    )
    for flag, name, read, words in _OPTION_ARGUMENTS:
        group.add_argument(flag, dest=f"option_{name}", type=read, help=words)


def options_of_arguments(options: dict[str, Any]) -> ContestantOptions:
    """Return the options that were given.

    Raises:
        InvalidDocument: One is out of its range.
    """
    given = {name: options.get(f"option_{name}") for _, name, _, _ in _OPTION_ARGUMENTS}
    return options_from_document({name: one for name, one in given.items() if one is not None})


def add_folder_argument(parser: ArgumentParser) -> None:
    """--folder FOLDER: where the catalogue is."""
    parser.add_argument(
        "--folder",
        type=Path,
        default=settings.BASE_DIR / "fixtures",
        help="holds scenes/*.json and scenarios/*.json; default: the project's own",
    )


_OPTION_ARGUMENTS: tuple[tuple[str, str, Callable[[str], object], str], ...] = (
    ("--temperature", "temperature", float, "sent where the model takes it; default: not sent"),
    ("--seed", "seed", int, "sent where the model takes it; sample k sends the seed + k - 1"),
    ("--reasoning-effort", "reasoning_effort", str, f"one of {', '.join(EFFORTS)}"),
    ("--max-output", "max_output_tokens", int, "tokens of one answer at most; default: 8192"),
    (
        "--protocol",
        "protocol",
        str,
        "prompt: the function is called in the answer; native: on the wire's own way; default: "
        "native where the model is known to do so",
    ),
    ("--rounds", "rounds", int, "with a review: at most so many, the first included; default: 3"),
    ("--accepted-from", "accepted_from", float, "the mean rating that text QA is content with; 4"),
    ("--radius", "radius_m", float, "metres around the ego that are written down; default: 80"),
    ("--prompt-version", "prompt_version", str, "run with these prompts or not at all"),
    ("--picture-px", "picture_px", int, "width of the viewer's picture; default: 1200"),
)


SETS = ("paper", "hard", "all")


def add_set_argument(parser: ArgumentParser, *, default: str) -> None:
    """--set paper|hard|all: which part of the catalogue."""
    parser.add_argument(
        "--set", dest="sets", choices=SETS, default=default, help=f"default: {default}"
    )


def sets_of(options: dict[str, Any]) -> tuple[CatalogueSet, ...]:
    """What was given; of all sets those that the folder has."""
    if options["sets"] != "all":
        return (CatalogueSet(options["sets"]),)
    return tuple(one for one in CatalogueSet if folder_of(options["folder"], one).is_dir())


def _usd(text: str) -> Decimal:
    try:
        return Decimal(text.removeprefix("$"))
    except InvalidOperation:
        raise ArgumentTypeError(f"{text!r} is no amount of money; use 2.50") from None
