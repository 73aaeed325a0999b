"""How static files are stored when they are collected."""

from __future__ import annotations

import re
from typing import Any

from django.core.files.base import ContentFile
from whitenoise.storage import CompressedManifestStaticFilesStorage

_COMMENT = re.compile(r"^[ \t]*(//.*|/\*[^*]*\*/[ \t]*)$\n?", re.MULTILINE)
_INDENT = re.compile(r"^[ \t]+|^\n", re.MULTILINE)
_AROUND_RULES = re.compile(r" (?=\{)|(?<=[{;,:>]) | (?=>)|;? ?(?=\})|(?<=\})\n")

_OPEN_LINE = re.compile(r"^((?:(?!//).)*[{;,(])\n", re.MULTILINE)
"""A line of a script without a comment (or an address) in it, whose end means nothing."""


class ModuleStorage(CompressedManifestStaticFilesStorage):  # type: ignore[misc] # untyped
    """Hashed names also inside `import` statements; comments and indentation stay at home."""

    support_js_module_import_aggregation = True

    def _save(self, name: str, content: Any) -> str:
        if name.endswith((".css", ".js")) and not name.startswith(("admin/", "rest_framework/")):
            whole = b"".join(content.chunks()).decode()
            content = ContentFile(as_served(name, whole).encode())
        return str(super()._save(name, content))


def as_served(name: str, text: str) -> str:
    """A script or style sheet of ours without comment lines, empty lines and indentation.

    A style sheet goes without blanks and semicolons around its braces as well, and without blanks
    behind its commas and colons and around its >; a script goes on in the same line where one
    ends in a way that nothing can be over. Ours have no text that spans lines, and style
    sheets none with one of these signs; tests keep it so.
    """
    lean = _INDENT.sub("", _COMMENT.sub("", text))
    return _AROUND_RULES.sub("", lean) if name.endswith(".css") else _OPEN_LINE.sub(r"\1", lean)
