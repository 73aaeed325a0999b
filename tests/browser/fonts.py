"""The fonts that the browser tests draw with: one family alone, whatever the machine has.

DejaVu Sans comes with matplotlib and is the widest that a system has as its only one; Liberation
Sans has the widths of Arial and lies beside this file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib

CONFIGURATION = """<?xml version="1.0"?>
<!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig>
  <dir>{fonts}</dir>
  <cachedir>{cache}</cachedir>
  <match target="pattern">
    <edit name="family" mode="append" binding="same"><string>{family}</string></edit>
  </match>
</fontconfig>
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class FontFamily:
    """A family, and the folder that holds the files of it."""

    name: str
    folder: Path
    files: str

    def configure(self, folder: Path) -> dict[str, str]:
        """The environment of a program that knows this family alone.

        Args:
            folder: An empty one for what fontconfig reads and keeps.
        """
        fonts = folder / "fonts"
        fonts.mkdir()
        for file in sorted(self.folder.glob(self.files)):
            (fonts / file.name).symlink_to(file)
        configuration = folder / "fonts.conf"
        configuration.write_text(
            CONFIGURATION.format(fonts=fonts, cache=folder / "cache", family=self.name)
        )
        return {"FONTCONFIG_FILE": str(configuration)}


DEJAVU = FontFamily(
    name="DejaVu Sans",
    folder=Path(matplotlib.get_data_path()) / "fonts" / "ttf",
    files="DejaVuSans*.ttf",
)
LIBERATION = FontFamily(
    name="Liberation Sans",
    folder=Path(__file__).parent / "liberation",
    files="LiberationSans-*.ttf",
)
