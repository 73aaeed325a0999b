from django.db import migrations, models


class Migration(migrations.Migration):
    dependencies = [
        ('arena', '0044_ask_why'),
    ]

    operations = [
        migrations.AddField(
            model_name='board',
            name='provisional_above',
            field=models.PositiveIntegerField(default=50, help_text='points to either side; a wider interval makes a line provisional'),
        ),
    ]
