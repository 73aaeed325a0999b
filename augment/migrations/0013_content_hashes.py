"""Give scenes that came in before there were content hashes, and the catalogue's, theirs."""

import hashlib
import json

from django.db import migrations


def fill_in(apps, schema_editor):
    """As augment.services.scenarios.scenes.content_hash did when this was written."""
    scenes = apps.get_model("augment", "BaseScene")
    for row in scenes.objects.filter(content_hash="").only("document").iterator(chunk_size=20):
        content = {
            key: value
            for key, value in row.document.items()
            if key not in ("name", "provenance")
        }
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        digest = hashlib.sha256(text.encode()).hexdigest()
        scenes.objects.filter(pk=row.pk).update(content_hash=digest)


class Migration(migrations.Migration):
    dependencies = [("augment", "0012_sets_of_the_catalogue")]

    operations = [migrations.RunPython(fill_in, migrations.RunPython.noop)]
