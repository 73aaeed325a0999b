from __future__ import annotations

from django.db import migrations, models

from augment.llm.wire_transport import host_and_port


def bind_keys(apps, schema_editor):
    """Let each key go on to the servers that it is sent to today, and to no other."""
    bindings = apps.get_model("augment", "KeyBinding").objects
    named = apps.get_model("augment", "Endpoint").objects.exclude(key_variable="")
    for variable, base_url in named.values_list("key_variable", "base_url"):
        if server := host_and_port(base_url):
            bindings.get_or_create(variable=variable, server=server)


class Migration(migrations.Migration):
    dependencies = [("augment", "0037_follow_up_set")]

    operations = [
        migrations.CreateModel(
            name="KeyBinding",
            fields=[
                ("id", models.BigAutoField(auto_created=True, primary_key=True, serialize=False, verbose_name="ID")),
                ("variable", models.CharField(max_length=80)),
                ("server", models.CharField(help_text="host:port", max_length=300)),
            ],
            options={
                "constraints": [models.UniqueConstraint(fields=("variable", "server"), name="a_key_is_bound_once")],
            },
        ),
        migrations.RunPython(bind_keys, migrations.RunPython.noop),
    ]
