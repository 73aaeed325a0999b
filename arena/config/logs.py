"""What the log leaves out."""

import logging
import re

_KEY_IN_ADDRESS = re.compile(r"(/(?:invitation|i|first|welcome)/)[A-Za-z0-9_-]+")


class HideKeys(logging.Filter):
    """Mask the tokens in addresses of invitations and pictures."""

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        hidden = _KEY_IN_ADDRESS.sub(r"\1...", text)
        if hidden != text:
            record.msg, record.args = hidden, None
        return True
