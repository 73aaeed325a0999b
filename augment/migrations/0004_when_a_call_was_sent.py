from django.apps.registry import Apps
from django.db import migrations, models
from django.db.backends.base.schema import BaseDatabaseSchemaEditor
from django.db.models import F


def say_that_all_were_sent(apps: Apps, editor: BaseDatabaseSchemaEditor) -> None:
    """Nobody wrote down when; what is not known to have stayed here may be billed."""
    calls = apps.get_model("augment", "ModelCall").objects.filter(served_from=None)
    calls.update(sent_at=F("started_at"))


class Migration(migrations.Migration):

    dependencies = [
        ("augment", "0003_attention_checks"),
    ]

    operations = [
        migrations.AlterField(
            model_name="modelcall",
            name="started_at",
            field=models.DateTimeField(help_text="room was reserved, the wait for a place began"),
        ),
        migrations.AddField(
            model_name="modelcall",
            name="sent_at",
            field=models.DateTimeField(
                blank=True,
                help_text="null while it waits, and for ever where it was not sent",
                null=True,
            ),
        ),
        migrations.RunPython(say_that_all_were_sent, migrations.RunPython.noop),
    ]
