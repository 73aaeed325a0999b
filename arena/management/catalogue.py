"""The German texts of voters' pages, compiled to what gettext reads."""

import polib
from django.conf import settings

from arena.exports.files import write_whole

SOURCE = settings.BASE_DIR / "arena" / "locale" / "de" / "LC_MESSAGES" / "django.po"


def compile_catalogue() -> None:
    """Write the catalogue to where Django looks; whoever reads meanwhile has a whole one."""
    target = settings.LOCALE_PATHS[0] / "de" / "LC_MESSAGES" / "django.mo"
    target.parent.mkdir(parents=True, exist_ok=True)
    write_whole(target, polib.pofile(str(SOURCE)).to_binary())
