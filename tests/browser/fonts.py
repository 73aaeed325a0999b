"""The one font of the browser tests, whatever the machine has: DejaVu Sans, the widest.

It comes with matplotlib.
"""

from pathlib import Path

import matplotlib

FAMILY = "DejaVu Sans"
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


def configure(folder: Path) -> dict[str, str]:
    """The environment of a program that knows this family alone.

    Args:
        folder: An empty one for what fontconfig reads and keeps.
    """
    fonts = folder / "fonts"
    fonts.mkdir()
    for file in (Path(matplotlib.get_data_path()) / "fonts" / "ttf").glob("DejaVuSans*.ttf"):
        (fonts / file.name).symlink_to(file)
    configuration = folder / "fonts.conf"
    configuration.write_text(
        CONFIGURATION.format(fonts=fonts, cache=folder / "cache", family=FAMILY)
    )
    return {"FONTCONFIG_FILE": str(configuration)}
