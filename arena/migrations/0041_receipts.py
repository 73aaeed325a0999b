"""Answers to POSTs that came with a key, so that they count once."""

from django.db import migrations, models


class Migration(migrations.Migration):
    dependencies = [("arena", "0040_entrants")]

    operations = [
        migrations.CreateModel(
            name="Receipt",
            fields=[
                (
                    "id",
                    models.BigAutoField(
                        auto_created=True, primary_key=True, serialize=False, verbose_name="ID"
                    ),
                ),
                ("key_hash", models.CharField(max_length=64, unique=True)),
                ("body_hash", models.CharField(max_length=64)),
                ("received_at", models.DateTimeField(db_index=True)),
                (
                    "status",
                    models.PositiveSmallIntegerField(
                        help_text="null while it is under way", null=True
                    ),
                ),
                ("answer", models.BinaryField(default=b"", help_text="sealed with the key")),
            ],
        )
    ]
