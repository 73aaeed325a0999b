"""Votes from a file are written at once: what a killed import had left behind goes."""

import django.db.models.deletion
from django.apps.registry import Apps
from django.db import migrations, models
from django.db.backends.base.schema import BaseDatabaseSchemaEditor


def remove_halves(apps: Apps, editor: BaseDatabaseSchemaEditor) -> None:
    apps.get_model("arena", "ImportedVote").objects.filter(file__study=None).delete()
    apps.get_model("arena", "VoteFile").objects.filter(study=None).delete()


class Migration(migrations.Migration):
    dependencies = [("arena", "0032_strength_of_preferences")]

    operations = [
        migrations.RunPython(remove_halves, migrations.RunPython.noop),
        migrations.RemoveField(model_name="votefile", name="written_at"),
        migrations.AlterField(
            model_name="votefile",
            name="study",
            field=models.OneToOneField(
                on_delete=django.db.models.deletion.CASCADE,
                related_name="vote_file",
                to="arena.study",
            ),
        ),
    ]
