from django.apps.registry import Apps
from django.db import migrations
from django.db.backends.base.schema import BaseDatabaseSchemaEditor


def change_values(apps: Apps, editor: BaseDatabaseSchemaEditor | None) -> None:
    """What was called fc had our function; fc is the paper's now, and ours is fc-plus."""
    contestants = apps.get_model("augment", "Contestant").objects
    for earlier in ("fc", "fc+tqa", "fc+vqa", "fc+geo"):
        contestants.filter(variant=earlier).update(variant=earlier.replace("fc", "fc-plus"))


class Migration(migrations.Migration):
    dependencies = [("augment", "0042_drives_have_a_version")]
    operations = [migrations.RunPython(change_values, migrations.RunPython.noop)]
