"""Filter that keeps secrets out of the log."""

import logging
import re

_KEY_IN_ADDRESS = re.compile(
    r"(/(?:enrol|invitation|i|first|welcome)/)[A-Za-z0-9_-]+(/?)(?:\?[^\s\"']*)?"
)


class HideKeys(logging.Filter):
    """Mask the tokens in addresses of links and pictures, and the ids of voters behind them."""

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        hidden = _KEY_IN_ADDRESS.sub(r"\1...\2", text)
        if hidden != text:
            record.msg, record.args = hidden, None
        return True
