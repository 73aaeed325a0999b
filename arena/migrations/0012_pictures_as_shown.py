"""A showing keeps the names of its two pictures: an augmentation may be drawn anew later."""

from __future__ import annotations

from typing import Any

from django.db import migrations, models
from django.db.models import OuterRef, Subquery


def keep_names(apps: Any, schema_editor: Any) -> None:
    Matchup = apps.get_model("arena", "Matchup")
    Augmentation = apps.get_model("augment", "Augmentation")
    for side in ("left", "right"):
        image = Augmentation.objects.filter(pk=OuterRef(f"{side}_id")).values("image")[:1]
        Matchup.objects.update(**{f"{side}_image": Subquery(image)})


class Migration(migrations.Migration):
    dependencies = [("arena", "0011_replay"), ("augment", "0010_what_sources_leave_open")]

    operations = [
        *(
            migrations.AddField(
                model_name="matchup",
                name=name,
                field=models.CharField(
                    blank=True, default="", help_text="name, as it was shown", max_length=120
                ),
                preserve_default=False,
            )
            for name in ("left_image", "right_image")
        ),
        migrations.RunPython(keep_names, migrations.RunPython.noop),
    ]
