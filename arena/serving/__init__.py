"""The process supervisor behind `manage.py serve`."""
