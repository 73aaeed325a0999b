"""How static files are stored when they are collected."""

from __future__ import annotations

import re
from typing import Any

from django.core.files.base import ContentFile
from whitenoise.storage import CompressedManifestStaticFilesStorage

_COMMENT = re.compile(r"^[ \t]*(//.*|/\*[^*]*\*/[ \t]*)$\n?", re.MULTILINE)
_INDENT = re.compile(r"^[ \t]+|^\n", re.MULTILINE)


class ModuleStorage(CompressedManifestStaticFilesStorage):  # type: ignore[misc] # untyped
    """Hashed names also inside `import` statements; comments and indentation stay at home."""

    support_js_module_import_aggregation = True

    def _save(self, name: str, content: Any) -> str:
        if name.endswith((".css", ".js")) and not name.startswith(("admin/", "rest_framework/")):
            whole = b"".join(content.chunks()).decode()
            content = ContentFile(lean(whole).encode())
        return str(super()._save(name, content))


def lean(text: str) -> str:
    """A script or style sheet of ours without comment lines, empty lines and indentation.

    Ours have no text that spans lines; a test keeps it so.
    """
    return _INDENT.sub("", _COMMENT.sub("", text))
