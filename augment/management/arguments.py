"""Arguments that several commands share."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

from django.conf import settings

from augment.services.running.caps import Caps


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
    """What was given."""
    return Caps(usd=options["cap_usd"], calls=options["cap_calls"], tokens=options["cap_tokens"])


def add_folder_argument(parser: ArgumentParser) -> None:
    """--folder FOLDER: where the catalogue is."""
    parser.add_argument(
        "--folder",
        type=Path,
        default=settings.BASE_DIR / "fixtures",
        help="holds scenes/*.json and scenarios/*.json; default: the project's own",
    )


def _usd(text: str) -> Decimal:
    try:
        return Decimal(text.removeprefix("$"))
    except InvalidOperation:
        raise ArgumentTypeError(f"{text!r} is no amount of money; use 2.50") from None
