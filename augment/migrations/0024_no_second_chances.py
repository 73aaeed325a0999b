"""What was unreadable stays so: nothing is asked anew."""

from django.db import migrations


class Migration(migrations.Migration):

    dependencies = [("augment", "0023_work")]

    operations = [migrations.RemoveField(model_name="augmentation", name="asked_anew_at")]
