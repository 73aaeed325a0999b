"""What `manage.py export` can write: the arguments of each kind and what writes it."""
