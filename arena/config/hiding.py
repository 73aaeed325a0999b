"""What no log may hold."""

from __future__ import annotations

import logging
import re

_KEY_IN_ADDRESS = re.compile(r"(/(?:invitation|i|first|welcome)/)[A-Za-z0-9_-]+")


class HideKeys(logging.Filter):
    """Replace the keys in addresses of invitations and pictures by three dots."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Let every line through, without keys."""
        text = record.getMessage()
        hidden = _KEY_IN_ADDRESS.sub(r"\1...", text)
        if hidden != text:
            record.msg, record.args = hidden, None
        return True
